"""One session at a time has the arm: another one is refused in a sentence, or takes over when it is told to."""

from __future__ import annotations

from unittest.mock import ANY

import pytest

from shared.foxglove import Log
from shared.messages import REPLACED, ArmLease, Heartbeat
from station.rig.arm_settings import ArmSettings
from tests.unit.arm.conftest import FakeRig, tilt_deg

BELONGS = "The arm belongs to another session (mine): wait until that has ended, or take over"


@pytest.fixture
def owned() -> FakeRig:
    """An arm that a session called "mine" has."""
    rig = FakeRig(ArmSettings())
    assert rig.claim("mine").accepted
    rig.advance(0.2, owner="mine")
    return rig


def beat(rig: FakeRig, owner: str, *, armed: bool = True, late_s: float = 0.0) -> None:
    stamp_ns = rig.clock.now_ns() - round(late_s * 1e9)
    rig.bus.publish("session/heartbeat", Heartbeat(stamp_ns, armed, owner))


def owners(rig: FakeRig) -> list[str]:
    return [message.owner for message in rig.of(ArmLease) if isinstance(message, ArmLease)]


def test_a_second_session_is_refused_in_one_sentence(owned: FakeRig) -> None:
    claimed = owned.claim("theirs")
    assert not claimed.accepted
    assert BELONGS in claimed.reason
    commanded = owned.command(10, owner="theirs")
    assert BELONGS in commanded.reason
    assert owned.command(10, owner="mine").accepted
    owned.advance(2, owner="mine")
    assert tilt_deg(owned) == pytest.approx(10, abs=1e-3)


def test_heartbeats_of_a_second_session_neither_keep_disarm_nor_acknowledge(owned: FakeRig) -> None:
    beat(owned, "theirs", armed=False)
    assert owned.command(10, owner="mine").accepted
    owned.stop("test")
    beat(owned, "theirs", armed=False)
    assert "stopped (test)" in owned.command(10, owner="mine").reason


@pytest.mark.parametrize("owner", ["theirs", ""])
def test_an_old_heartbeat_of_a_session_that_nobody_has_heard_moves_nothing(owned: FakeRig, owner: str) -> None:
    owned.command(10, owner="mine")
    owned.advance(2.0, owner="mine")
    owned.stop("a hand in the rig")
    owned.advance(0.1, armed=False, owner="mine")
    stopped_at = tilt_deg(owned)
    beat(owned, owner, late_s=3600.0)
    owned.advance(20.0, heartbeat=False)
    assert owned.of(ArmLease)[-1] == ArmLease(ANY, "", "a hand in the rig")
    assert tilt_deg(owned) == pytest.approx(stopped_at, abs=1e-6)


@pytest.mark.parametrize("resting", [True, False])
def test_a_stop_is_published_and_holds_the_plate_until_the_arm_is_armed_again(owned: FakeRig, resting: bool) -> None:
    if not resting:
        owned.command(10, owner="mine")
        owned.advance(0.5, owner="mine")
    owned.stop("by hand")
    owned.advance(0.1, owner="mine")
    assert owned.of(ArmLease)[-1] == ArmLease(ANY, "mine", "by hand")
    count = len(owned.of(ArmLease))
    owned.advance(3.0, owner="mine")
    assert len(owned.of(ArmLease)) >= count + 2, "whoever comes later must hear of it"
    stopped_at = tilt_deg(owned)
    owned.advance(0.1, armed=False, owner="mine")
    owned.advance(20.0, heartbeat=False)
    assert owned.of(ArmLease)[-1] == ArmLease(ANY, "", "by hand")
    assert tilt_deg(owned) == pytest.approx(stopped_at, abs=1e-6)
    owned.advance(0.1, owner="mine")
    assert owned.of(ArmLease)[-1] == ArmLease(ANY, "mine", "")


def test_the_next_session_lifts_a_stop_that_came_between_two(owned: FakeRig) -> None:
    owned.advance(0.1, armed=False, owner="mine")
    owned.stop("by hand")
    assert owned.claim("theirs").accepted
    owned.advance(0.1, heartbeat=False)
    assert owned.of(ArmLease)[-1] == ArmLease(ANY, "theirs", "by hand"), "a claim alone moves nothing"
    owned.advance(0.1, owner="theirs")
    assert owned.of(ArmLease)[-1] == ArmLease(ANY, "theirs", "")
    assert owned.command(10, owner="theirs").accepted


def test_the_session_that_was_stopped_lifts_nothing_whoever_disarmed(owned: FakeRig) -> None:
    """It may be stopped itself (SIGSTOP) until its time is over, and know nothing of all that happened meanwhile."""
    owned.stop("by hand")
    owned.advance(2, heartbeat=False)
    owned.advance(0.5, owner="theirs", armed=False)
    owned.advance(1, owner="mine")
    assert owned.of(ArmLease)[-1] == ArmLease(ANY, "mine", "by hand")
    assert "stopped (by hand)" in owned.command(10, owner="mine").reason


def test_who_takes_over_stops_the_motion_and_is_obeyed_alone(owned: FakeRig) -> None:
    owned.command(30, owner="mine")
    owned.advance(1, owner="mine")
    assert owned.claim("theirs", take_over=True).accepted
    owned.advance(2, owner="theirs")
    assert "theirs has taken the arm over from session mine" in owned.reports[1].fault
    held = tilt_deg(owned)
    assert 5 < held < 25
    assert "belongs to another session (theirs)" in owned.command(30, owner="mine").reason
    assert owned.command(0, owner="theirs").accepted
    owned.advance(5, owner="theirs")
    assert tilt_deg(owned) == pytest.approx(0, abs=1e-3)
    assert owners(owned)[0] == "mine"
    assert owners(owned)[-1] == "theirs"


def test_after_a_take_over_the_arm_is_armed_by_the_new_session_alone(owned: FakeRig) -> None:
    assert owned.claim("theirs", take_over=True).accepted
    assert "not armed" in owned.command(10, owner="theirs").reason
    beat(owned, "theirs")
    assert owned.command(10, owner="theirs").accepted


@pytest.mark.parametrize("armed", [True, False])
def test_a_command_that_has_not_begun_ends_with_a_take_over(owned: FakeRig, armed: bool) -> None:
    assert owned.command(20, owner="mine").accepted
    assert owned.claim("theirs", take_over=True).accepted
    owned.advance(4, owner="theirs", armed=armed)
    assert tilt_deg(owned) == pytest.approx(0, abs=1e-6)
    (report,) = owned.reports
    assert (report.run, report.step) == (1, 1)
    assert report.end_ns == report.begin_ns > 0
    assert report.fault


def test_a_command_that_has_not_begun_ends_with_disarming(owned: FakeRig) -> None:
    assert owned.command(20, owner="mine").accepted
    beat(owned, "mine", armed=False)
    owned.advance(4, owner="mine", armed=False)
    assert tilt_deg(owned) == pytest.approx(0, abs=1e-6)
    assert [report.fault for report in owned.reports] == [
        "The arm is not armed: the station's heartbeat does not ask for it."
    ]


def test_who_takes_over_and_commands_at_once_is_obeyed_in_place_of_what_moved(owned: FakeRig) -> None:
    owned.command(30, owner="mine")
    owned.advance(1, owner="mine")
    assert owned.claim("theirs", take_over=True).accepted
    beat(owned, "theirs")
    assert owned.command(0, owner="theirs").accepted
    owned.advance(5, owner="theirs")
    assert [bool(report.end_ns) for report in owned.reports] == [False, True, False, True]
    assert owned.reports[1].fault == REPLACED
    assert tilt_deg(owned) == pytest.approx(0, abs=1e-3)


def test_disarming_holds_the_motion_and_the_plate_is_levelled_whoever_beats(owned: FakeRig) -> None:
    owned.command(60, owner="mine")
    owned.advance(1, owner="mine")
    owned.advance(3, owner="mine", armed=False)
    held = tilt_deg(owned)
    assert 5 < held < 15
    assert owned.reports[1].fault == "the session has disarmed the arm"
    owned.advance(1, owner="mine", armed=False)
    assert tilt_deg(owned) == pytest.approx(held, abs=1e-6)
    owned.advance(15, owner="mine", armed=False)
    assert tilt_deg(owned) == pytest.approx(0, abs=1e-3)


@pytest.mark.parametrize(
    ("claims", "reason"), [(True, "the arm is disarmed"), (False, "the station's heartbeat is lost")]
)
def test_who_does_not_arm_watches_no_plate(owned: FakeRig, claims: bool, reason: str) -> None:
    owned.command(30, owner="mine")
    owned.advance(5, owner="mine")
    owned.advance(2, heartbeat=False)
    assert not claims or owned.claim("theirs").accepted
    owned.advance(30, owner="theirs", armed=False)
    assert tilt_deg(owned) == pytest.approx(0, abs=1e-3)
    said = [message.message for message in owned.of(Log) if isinstance(message, Log)]
    assert f"{reason}: levelling slowly" in said


@pytest.mark.parametrize("ends", ["disarms", "falls silent"])
def test_an_arm_that_is_free_again_is_the_next_ones(owned: FakeRig, ends: str) -> None:
    if ends == "disarms":
        beat(owned, "mine", armed=False)
    else:
        owned.advance(2, heartbeat=False)
    assert owned.claim("theirs").accepted
    assert not owned.claim("mine").accepted


@pytest.mark.parametrize("ends", ["is taken over from", "falls silent"])
def test_a_session_that_has_lost_the_arm_gets_it_again_only_by_taking_over(owned: FakeRig, ends: str) -> None:
    """It may have slept while another one moved the plate, and lifted the stop that was meant for it."""
    if ends == "falls silent":
        owned.advance(2, heartbeat=False)
    assert owned.claim("theirs", take_over=ends == "is taken over from").accepted
    beat(owned, "theirs", armed=False)
    owned.advance(0.2, owner="mine")
    refused = owned.command(10, owner="mine")
    assert not refused.accepted
    assert "This session has lost the arm to session theirs" in owned.claim("mine").reason
    assert owned.claim("mine", take_over=True).accepted
    owned.advance(0.2, owner="mine")
    assert owned.command(10, owner="mine").accepted


def test_a_heartbeat_that_was_held_up_takes_nothing(owned: FakeRig) -> None:
    owned.advance(1, owner="mine")
    beat(owned, "mine", armed=False)
    beat(owned, "mine", late_s=0.5)
    assert owned.claim("theirs").accepted


def test_an_arm_agent_that_was_started_again_knows_its_session_by_its_heartbeat() -> None:
    rig = FakeRig(ArmSettings())
    rig.advance(0.2, owner="mine")
    assert not rig.claim("theirs").accepted
    assert rig.command(10, owner="mine").accepted
