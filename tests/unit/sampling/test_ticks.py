"""The session's tick: one thing is done in each, and nothing after the end."""

from __future__ import annotations

from dataclasses import replace

import pytest

from shared.messages import Heartbeat, PlatformState
from station.sampling.phases import Phases
from station.sampling.plan import Plan
from station.sampling.ticks import Ticks
from tests.unit.sampling.given_phases import SECOND_NS, know_clocks, phases, told

PLAN = Plan(samples=3)


def tick(found: Phases, plan: Plan = PLAN, *, later_s: float = 0.0) -> list[str]:
    """Returns what is told after one tick."""
    found.state.begin(found.state.now_ns + round(later_s * SECOND_NS))
    Ticks(plan, found).tick(Heartbeat(found.state.now_ns, True, "mine"))
    return told(found.state.actions)


def test_a_session_begins_once_all_are_heard() -> None:
    found = phases(PLAN)
    assert tick(found) == []
    assert found.tracks.take_attitude(PlatformState(found.state.now_ns), now_ns=found.state.now_ns, within_s=1.0)
    found.state.found_ns = found.state.now_ns
    assert tick(found) == ["SYNC"]
    assert found.state.owner == "mine"


@pytest.mark.parametrize(
    ("answered", "said"),
    [
        (True, "expected the plate's attitude (arm/platform) and corners of the marker (camera/corners) within"),
        (False, "expected answers from camera/clock and arm/clock to the station's pings within"),
    ],
)
def test_a_session_that_hears_nobody_ends(answered: bool, said: str) -> None:
    found, late_s = phases(PLAN), PLAN.timeout_s + 1.0
    if answered:
        know_clocks(found, now_ns=found.state.now_ns + round(late_s * SECOND_NS))
    (level, end) = tick(found, later_s=late_s)
    assert level == "error"
    assert said in end


@pytest.mark.parametrize(("phase", "named"), [("TILT", ["ABORTED", "error"]), ("ABORTED", [])])
def test_a_stop_ends_the_session_and_a_run_that_goes_on(phase: str, named: list[str]) -> None:
    found = phases(PLAN, phase=phase)
    found.state.stopped = "by hand"
    *before, end = tick(found)
    assert before == named
    assert end.startswith("finish: the arm is stopped (by hand)")


def test_an_outage_that_has_lasted_too_long_ends_the_session_and_nothing_follows() -> None:
    plan = replace(PLAN, outage_s=30.0)
    found = phases(plan, phase="ABORTED")
    found.state.outage = "the link was cut"
    found.state.awaited, found.state.asked_ns = (1, 0), 1  # a motion to level that nobody answered
    (end,) = tick(found, plan, later_s=31.0)
    assert end.startswith("finish: waited 30 s for the camera agent and the arm agent in vain")


def test_the_next_run_waits_longer_after_each_fault() -> None:
    for faults, pause_s in ((1, 1.0), (2, 2.0), (4, 8.0), (9, 16.0)):
        found = phases(PLAN, phase="ABORTED")
        found.state.faults = faults
        assert tick(found, later_s=pause_s - 0.1) == []
        assert tick(found, later_s=0.2) == ["LEVEL"]


def test_a_slip_known_to_the_end_of_its_run_is_marked_when_no_frames_come() -> None:
    found = phases(PLAN, phase="RETURN")
    tick(found)
    assert found.state.run.flags == ["disturbed_cut"]
