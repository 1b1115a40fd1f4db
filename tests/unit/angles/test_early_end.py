"""The reason that a comparison gives for its early end."""

from __future__ import annotations

import threading
from collections.abc import Callable

import pytest

from shared.bus import Received
from shared.clock import SimulatedClock
from shared.memory_bus import MemoryBus
from shared.messages import MotionReport
from shared.rig import RigConfig
from station.angles.plan import ComparisonPlan
from station.app import assembly
from station.app.commands import compare_angles
from station.arm.agent import arm_agent
from station.simulators.mujoco.twin import Twin

_STEP_NS = 10_000_000


class _RigBus(MemoryBus):
    """A bus at whose polls a simulated rig and what a test does take their turn."""

    def __init__(self, clock: SimulatedClock, rig: RigConfig) -> None:
        super().__init__(clock)
        self._time = clock
        world = assembly.twin_world(rig, seed=1, start_ns=clock.now_ns())
        world.remove_block()
        self._turns = (Twin(self, world).tick, arm_agent(self, assembly.arm_settings(rig)).tick)
        self.on_poll: Callable[[], None] = lambda: None

    def poll(self, timeout_s: float = 0.0) -> int:
        self._time.advance_to(self._time.now_ns() + _STEP_NS)
        for turn in self._turns:
            turn(self._time.now_ns())
        self.on_poll()
        return super().poll(timeout_s)


def test_a_user_who_stops_it_in_a_motion_is_the_reason(capsys: pytest.CaptureFixture[str]) -> None:
    """The arm reports that it was disarmed, which ended the motion and is no reason of its own."""
    clock, rig = SimulatedClock(), assembly.rig_from(None)
    bus = _RigBus(clock, rig)
    end = compare_angles._End(threading.Event())  # pyright: ignore[reportPrivateUsage]
    reports: list[MotionReport] = []
    began_ns = clock.now_ns()

    def keep(received: Received) -> None:
        assert isinstance(received.message, MotionReport)
        reports.append(received.message)

    def press_ctrl_c() -> None:
        if any(report.step == 1 and not report.end_ns for report in reports):
            end.stopped.set()
        assert clock.now_ns() - began_ns < 60_000_000_000, "the arm never began to move"

    bus.subscribe("arm/motion", keep)
    bus.on_poll = press_ctrl_c
    plan = ComparisonPlan(step_deg=10.0, readings=1, sweeps=1, rate_deg_s=1.0)
    said = compare_angles._conduct(bus, rig, plan, clock=clock, end=end, owner="me")  # pyright: ignore[reportPrivateUsage]
    assert said == "stopped by the user"
    assert [report.fault for report in reports if report.fault] == ["the session has disarmed the arm"]
    capsys.readouterr()
