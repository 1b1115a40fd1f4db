"""The twin on the bus."""

from __future__ import annotations

import math

import pytest

from shared.bus import Received
from shared.clock import SimulatedClock
from shared.memory_bus import MemoryBus
from shared.messages import JointState, JointTarget, TwinScene
from station.simulators.mujoco.specimen import Friction
from station.simulators.mujoco.twin import Twin
from tests.unit.simulators.rides import hinge_world

TICK_NS = 5_000_000


class Listener:
    """Keeps what a twin says."""

    def __init__(self, bus: MemoryBus) -> None:
        self.joints: list[JointState] = []
        self.scenes: list[TwinScene] = []
        bus.subscribe("twin/joints", self._take)
        bus.subscribe("truth/scene", self._take)

    def _take(self, received: Received) -> None:
        message = received.message
        if isinstance(message, JointState):
            self.joints.append(message)
        elif isinstance(message, TwinScene):
            self.scenes.append(message)


def rig(**options: int) -> tuple[SimulatedClock, MemoryBus, Twin, Listener]:
    clock = SimulatedClock()
    bus = MemoryBus(clock)
    world = hinge_world(Friction(mean_angle_rad=0.3), start_ns=clock.now_ns())
    return clock, bus, Twin(bus, world, **options), Listener(bus)


def test_it_is_announced() -> None:
    _, bus, _, _ = rig()
    assert "twin" in bus.alive()


def test_every_tick_says_where_the_joints_are() -> None:
    clock, bus, twin, listener = rig()
    for number in range(400):
        clock.advance_to(clock.now_ns() + TICK_NS)
        if number % 2 == 0:
            bus.publish("twin/target", JointTarget(clock.now_ns(), (0.2,), (0.0,)))
        twin.tick(clock.now_ns())
    assert len(listener.joints) == len(listener.scenes) == 400
    last, scene = listener.joints[-1], listener.scenes[-1]
    assert last.stamp_ns == clock.now_ns()
    assert last.name == ("tilt",)
    assert last.position_rad == pytest.approx((0.2,), abs=1e-5)
    assert len(last.effort_nm) == 1
    # The scene is the same truth: the plate is tilted by that much, and the block lies on it.
    assert 2 * math.asin(scene.qx) == pytest.approx(0.2, abs=1e-5)
    assert scene.block_z_m == pytest.approx(0.005, abs=1e-4)
    assert scene.mu == pytest.approx(math.tan(0.3))


def test_the_scene_may_come_at_its_own_rate() -> None:
    clock, _, twin, listener = rig(scene_period_ns=10_000_000)
    for _ in range(200):
        clock.advance_to(clock.now_ns() + TICK_NS)
        twin.tick(clock.now_ns())
    assert len(listener.scenes) == 100


def test_a_target_of_another_arm_is_named_and_ends_nothing(caplog: pytest.LogCaptureFixture) -> None:
    clock, bus, twin, listener = rig()
    bus.publish("twin/target", JointTarget(clock.now_ns(), (0.0,) * 6, (0.0,) * 6))
    twin.tick(clock.now_ns())
    assert "1 joints of hinge" in caplog.text
    assert bus.malformed == {"twin/target": 1}
    assert len(listener.joints) == 1


def test_a_stream_that_ends_stops_the_arm() -> None:
    """The joints come to rest and do not run on when the arm agent dies in mid-motion."""
    clock, bus, twin, listener = rig()
    for number in range(100):
        clock.advance_to(clock.now_ns() + TICK_NS)
        bus.publish("twin/target", JointTarget(clock.now_ns(), (0.001 * number,), (0.2,)))
        twin.tick(clock.now_ns())
    for _ in range(200):
        clock.advance_to(clock.now_ns() + TICK_NS)
        twin.tick(clock.now_ns())
    assert listener.joints[-1].velocity_rad_s == pytest.approx((0.0,), abs=1e-4)
    assert listener.joints[-1].position_rad[0] < 0.099 + 0.2 * 0.06
