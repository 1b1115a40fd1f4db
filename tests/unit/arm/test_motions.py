"""A motion begins where the one before has brought the arm at that very moment, however late that is."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from shared.messages import REPLACED
from station.arm.drivers.simulated import SimulatedArm
from station.arm.trajectory import JointTrajectory
from station.rig.arm_settings import ArmSettings
from tests.unit.arm.conftest import FakeRig

BUSY_NS = 150_000_000


class Told(SimulatedArm):
    """An arm that notes how far from its place in the motion under way the next one begins, and when it is halted."""

    jumps_deg: list[float]
    halts_ns: list[int]

    def start(self, trajectory: JointTrajectory, *, now_ns: int) -> None:
        where = self._where(now_ns)
        if where is not None:
            Told.jumps_deg.append(math.degrees(np.abs(trajectory.position_rad[0] - where).max()))
        super().start(trajectory, now_ns=now_ns)

    def _where(self, now_ns: int) -> NDArray[np.float64] | None:
        return self._motion.at(now_ns - self._began_ns)[0] if self._motion else None

    def halt(self, *, now_ns: int) -> None:
        Told.halts_ns.append(now_ns)
        super().halt(now_ns=now_ns)


@pytest.fixture
def tilting(monkeypatch: pytest.MonkeyPatch) -> FakeRig:
    """An arm that tilts at 20 degrees/s."""
    Told.jumps_deg, Told.halts_ns = [], []
    monkeypatch.setattr("station.arm.drivers.simulated.SimulatedArm", Told)
    rig = FakeRig(ArmSettings())
    rig.advance(0.2)
    assert rig.command(45, rate_deg_s=20.0).accepted
    rig.advance(1.0)
    return rig


def be_busy(rig: FakeRig) -> None:
    rig.clock.advance_to(rig.clock.now_ns() + BUSY_NS)


@pytest.mark.parametrize("busy", [False, True])
def test_a_return_in_mid_motion_begins_where_the_arm_is_by_then(tilting: FakeRig, busy: bool) -> None:
    assert tilting.command(0, rate_deg_s=20.0).accepted
    if busy:
        be_busy(tilting)
    tilting.advance(0.05)
    assert tilting.reports[1].fault == REPLACED
    assert max(Told.jumps_deg) < 1e-3


def test_a_motion_of_the_agent_s_own_begins_where_the_arm_is_by_then(tilting: FakeRig) -> None:
    be_busy(tilting)
    tilting.advance(1.5, heartbeat=False)
    assert "heartbeat is lost" in tilting.reports[1].fault
    assert max(Told.jumps_deg) < 1e-3


def test_a_stop_halts_where_the_arm_is_by_then(tilting: FakeRig) -> None:
    be_busy(tilting)
    tilting.stop("by hand")
    tilting.advance(0.01)
    assert Told.halts_ns == [tilting.clock.now_ns()]


def test_a_command_that_may_no_longer_be_once_it_would_begin_is_told_to_its_session(tilting: FakeRig) -> None:
    assert tilting.command(0, rate_deg_s=20.0).accepted
    tilting.clock.advance_to(tilting.clock.now_ns() + 2_000_000_000)  # nobody has heard the station meanwhile
    tilting.advance(0.01, heartbeat=False)
    never = tilting.reports[1]
    assert never.begin_ns == never.end_ns > 0
    assert "no heartbeat" in never.fault
