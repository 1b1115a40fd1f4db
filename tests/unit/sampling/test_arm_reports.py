"""The arm's part of a session: refusals, takings over, and the ends of motions."""

from __future__ import annotations

import pytest

from shared.messages import ArmLease, ArmReply, MotionReport
from station.sampling.arm_reports import OWN_ORDER, ArmReports
from station.sampling.phases import Phases
from station.sampling.plan import Plan
from tests.unit.sampling.given_phases import phases, told


@pytest.fixture
def found() -> Phases:
    """Phases that await the motion to level of the first run."""
    found = phases(Plan())
    found.level()
    found.state.begin(found.state.now_ns)
    found.state.seen_ns = found.state.attitude_ns = found.state.now_ns
    return found


def test_a_refused_command_gives_the_run_up_and_another_ones_does_not(found: Phases) -> None:
    arm = ArmReports(found)
    arm.reply(ArmReply(reason="no", run=1, step=7))
    arm.reply(ArmReply(accepted=True, run=1, step=0))
    assert found.state.phase == "LEVEL"
    arm.reply(ArmReply(reason="no", run=1, step=0))
    assert (found.state.phase, found.state.awaited) == ("ABORTED", None)
    assert told(found.state.actions) == ["ABORTED", "error"]


def test_whoever_takes_the_arm_over_ends_the_session(found: Phases) -> None:
    found.state.owner = "mine"
    arm = ArmReports(found)
    arm.lease(ArmLease(owner="mine", stopped="by hand"))
    assert (found.state.phase, found.state.stopped) == ("LEVEL", "by hand")
    arm.lease(ArmLease(owner="theirs"))
    assert told(found.state.actions)[-1] == "finish: another session (theirs) has taken the arm over"


def test_a_motion_is_told_at_its_begin_and_its_end_lets_the_run_go_on(found: Phases) -> None:
    now_ns, arm = found.state.now_ns, ArmReports(found)
    arm.motion(MotionReport(now_ns, 1, 0, now_ns))
    assert found.state.awaited == (1, 0)
    arm.motion(MotionReport(now_ns, 1, 0, now_ns, now_ns))
    assert found.state.awaited is None
    assert told(found.state.actions) == ["STEP_BEGIN", "STEP_END", "DWELL"]


def test_an_older_sessions_motion_is_none_of_this_one(found: Phases) -> None:
    long_ago_ns = found.state.now_ns - 10**9
    ArmReports(found).motion(MotionReport(found.state.now_ns, 1, 0, long_ago_ns, long_ago_ns))
    assert found.state.awaited == (1, 0)


def test_an_arm_that_moves_by_itself_ends_the_run_as_an_outage(found: Phases) -> None:
    later_ns = found.state.now_ns + 1
    ArmReports(found).motion(MotionReport(later_ns, OWN_ORDER, 0, later_ns))
    assert found.state.phase == "ABORTED"
    assert found.state.outage
    assert not found.state.faults
