"""The twin's physics is the same however rarely it is asked: a slow camera does not make the plate jerk."""

from __future__ import annotations

import heapq
import math

import pytest

from shared.clock import SimulatedClock
from shared.geometry import tilt_of
from shared.memory_bus import MemoryBus
from shared.messages import Heartbeat, Message, TiltCommand, TwinScene
from station.app import assembly
from station.app.commands.twin import tick_rate_hz
from station.arm.agent import arm_agent
from station.arm.loop import RATE_HZ
from station.simulators.mujoco.twin import Twin

TILT_DEG_S = 5.0
MOVED_M = 1e-4


def onset_deg(rate_hz: float) -> tuple[float, float]:
    """The tilt at which the block was first seen to have moved, and the friction angle that was drawn (degrees).

    Arm agent and twin tick each at its own rate, as their processes do.
    """
    rig, clock = assembly.rig_from(None), SimulatedClock()
    bus, scenes, replies = MemoryBus(clock), list[TwinScene](), list[Message | None]()
    twin = Twin(bus, assembly.twin_world(rig, seed=1, start_ns=clock.now_ns()))
    arm = arm_agent(bus, assembly.arm_settings(rig))
    bus.subscribe("truth/scene", lambda received: scenes.append(received.message))  # pyright: ignore[reportArgumentType]
    start = clock.now_ns()

    def beat(now_ns: int) -> None:
        bus.publish("session/heartbeat", Heartbeat(now_ns, armed=True))

    due = [
        (start, 0, round(1e9 / RATE_HZ), arm.tick),
        (start + 1, 1, round(1e9 / rate_hz), twin.tick),
        (start, 2, 50_000_000, beat),
    ]
    heapq.heapify(due)
    now_ns = start
    while now_ns < start + 15_000_000_000:
        now_ns, rank, period_ns, what = due[0]
        heapq.heapreplace(due, (now_ns + period_ns, rank, period_ns, what))
        clock.advance_to(now_ns)
        what(now_ns)
        if now_ns > start + 1_000_000_000 and not replies:
            up = TiltCommand(now_ns, 1, angle_rad=math.radians(40), step=1, rate_rad_s=math.radians(TILT_DEG_S))
            bus.request("arm/command", up, replies.append)
        if scenes and math.dist(_place(scenes[-1]), _place(scenes[0])) > MOVED_M:
            last = scenes[-1]
            return math.degrees(tilt_of(last.qw, last.qx, last.qy, last.qz)), math.degrees(math.atan(last.mu))
    raise AssertionError("the block never moved")


def _place(scene: TwinScene) -> tuple[float, float]:
    return scene.block_x_m, scene.block_y_m


@pytest.mark.parametrize("rate_hz", [40.0, 60.0, 180.0])
def test_the_friction_is_the_same_at_every_rate(rate_hz: float):
    seen, drawn = onset_deg(rate_hz)
    # Seen at the next tick, after the slide of 0.1 mm, which takes less than 0.1 s.
    assert 0 < seen - drawn < TILT_DEG_S * (1 / rate_hz + 0.1)


@pytest.mark.parametrize("camera_hz", [5.0, 20.0, 30.0, 58.9, 90.0, 180.0])
def test_the_joints_are_read_as_often_as_the_arm_agent_needs_and_two_scenes_come_to_a_frame(camera_hz: float):
    rate_hz = tick_rate_hz(camera_hz)
    assert rate_hz >= 100
    assert (rate_hz / camera_hz) % 2 == pytest.approx(0)
    assert tick_rate_hz(90.0) == 180.0
