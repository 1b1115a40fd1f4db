"""The state machine on a rig made of arithmetic, in good order and with every part of it failing in turn."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from shared.messages import (
    REPEATED,
    ArmLease,
    ArmReply,
    CameraGeometry,
    ClockOffset,
    Environment,
    Heartbeat,
    MarkerCorners,
    Message,
    MotionReport,
    PlatformState,
    SessionPause,
)
from station.rig.opening import Opening
from station.sampling.arm_reports import OWN_ORDER
from station.sampling.direction import slide_in_image
from station.sampling.machine import SamplingMachine
from station.sampling.plan import DirectionPlan, DwellPlan, Plan, ReferencePlan, SlipPlan, TiltPlan
from station.sampling.run import Specimen
from tests.unit.sampling.scripted_rig import GEOMETRY, ScriptedRig

GOOD_RUN = ["LEVEL", "DWELL", "REFERENCE", "TILT", "SLIP", "SETTLE", "RETURN", "DONE"]


def finished(rig: ScriptedRig, *, seconds: float = 120.0) -> ScriptedRig:
    rig.run(seconds)
    assert rig.fault is not None, f"still in {rig.machine.phase} after {seconds} s"
    return rig


def test_the_rate_of_each_run_is_drawn_from_the_plans() -> None:
    plan = Plan(samples=12, tilt=TiltPlan(rates_deg_s=(4.0, 12.0)))
    rates = [math.degrees(sample.tilt_rate_rad_s) for sample in finished(ScriptedRig(plan), seconds=600.0).samples]
    assert {round(rate) for rate in rates} == {4, 12}
    assert rates != sorted(rates)


@pytest.mark.parametrize("rates", [(0.0,), (5.0, -1.0), (math.inf,)])
def test_a_rate_is_positive(rates: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match=r"expected .*rates_deg_s"):
        TiltPlan(rates_deg_s=rates)


def test_a_good_session_goes_through_the_papers_phases_and_ends_level():
    rig = finished(ScriptedRig(Plan(samples=3)))
    assert rig.phases() == ["SYNC", *GOOD_RUN * 3]
    assert rig.fault == ""
    assert [sample.run for sample in rig.samples] == [1, 2, 3]
    assert rig.tilt_rad == 0.0
    assert [sample.previous_direction for sample in rig.samples] == [-1, *(s.direction for s in rig.samples[:2])]


def test_the_sample_is_table_ii_and_more():
    rig = finished(ScriptedRig(Plan(samples=1), friction_rad=0.3))
    sample = rig.samples[0]
    assert len(sample.reference_corners_px) == len(sample.corner_variance_px2) == len(sample.post_corners_px) == 8
    assert sample.onset_angle_rad == pytest.approx(0.3, abs=math.radians(0.05))
    assert math.hypot(*sample.euler_rad[:2]) == pytest.approx(0.3, abs=math.radians(3))
    assert sample.slip_ns < sample.detect_ns
    assert sample.step_from_rad < 0.3 <= sample.step_to_rad + 1e-9
    assert sample.dwell_s == pytest.approx(0.6, abs=0.15)
    moved = np.hypot(*(np.array(sample.post_corners_px) - np.array(sample.reference_corners_px)).reshape(4, 2).T)
    assert np.all(moved > 25)
    assert not sample.censored
    assert sample.flags == ()


def test_every_step_carries_its_begin_and_end_as_executed():
    rig = finished(ScriptedRig(Plan(samples=1)))
    begins = [(event.run, event.step) for event in rig.events if event.phase == "STEP_BEGIN"]
    ends = [(event.run, event.step) for event in rig.events if event.phase == "STEP_END"]
    asked = [(command.run, command.step) for command in rig.commands]
    assert begins == asked
    assert set(ends) <= set(asked)
    assert len(asked) == len(set(asked))


def test_without_a_slip_the_run_is_kept_as_censored():
    rig = finished(ScriptedRig(Plan(samples=1, tilt=TiltPlan(max_deg=15.0)), friction_rad=0.5))
    sample = rig.samples[0]
    assert sample.censored
    assert sample.onset_angle_rad == pytest.approx(math.radians(15.0))
    assert sample.slip_ns == 0
    assert "SLIP" not in rig.phases()
    assert rig.tilt_rad == 0.0


def test_the_arms_reach_bounds_the_tilt():
    rig = finished(ScriptedRig(Plan(samples=1), friction_rad=1.0, reach_rad=math.radians(22.0)))
    assert max(command.angle_rad for command in rig.commands) == pytest.approx(math.radians(22.0))
    assert rig.samples[0].censored


def test_after_enough_samples_the_range_narrows_and_the_first_step_goes_straight_to_its_lower_bound():
    plan = Plan(samples=9, tilt=TiltPlan(adapt_after=1, adapt_sd=3.0), direction=DirectionPlan(distance_power=1.0))
    rig = ScriptedRig(dataclasses.replace(plan, tilt=TiltPlan(adapt_after=2)))
    rng = np.random.default_rng(3)
    while rig.fault is None:
        count = len(rig.samples)
        rig.friction_rad = 0.3 + 0.01 * float(rng.standard_normal())
        rig.run(60.0, until=lambda rig, count=count: len(rig.samples) > count or rig.fault is not None)
    first_steps = {c.run: c.angle_rad for c in rig.commands if c.step == 1 and c.run}
    tilts = {c.run: c.angle_rad for c in rig.commands if c.run and c.angle_rad > 0 and c.step == 1}
    assert first_steps
    assert any(angle > math.radians(5) for angle in tilts.values())
    assert all(not sample.censored or sample.onset_angle_rad > 0.25 for sample in rig.samples)


def test_dwells_are_drawn_log_uniformly_between_their_bounds():
    rig = finished(ScriptedRig(Plan(samples=12, dwell=DwellPlan(min_s=0.3, max_s=3.0))), seconds=400)
    dwells = [sample.dwell_s for sample in rig.samples]
    assert min(dwells) >= 0.3
    assert max(dwells) < 3.3
    assert max(dwells) / min(dwells) > 3


# --- faults ----------------------------------------------------------------------------------------------------------


def blind_in(phase: str):
    def hook(message: MarkerCorners, rig: ScriptedRig) -> MarkerCorners:
        blind = rig.machine.phase == phase and len(rig.samples) == 0 and "ABORTED" not in rig.phases()
        return dataclasses.replace(message, found=False, corners_px=(), reason="glare") if blind else message

    return hook


@pytest.mark.parametrize("phase", ["DWELL", "REFERENCE", "TILT"])
def test_when_the_marker_vanishes_the_run_is_given_up_in_words_and_the_next_one_goes_on(phase: str):
    rig = finished(ScriptedRig(Plan(samples=1), on_corners=blind_in(phase)))
    aborted = next(event for event in rig.events if event.phase == "ABORTED")
    assert "expected corners of the marker" in aborted.reason
    assert rig.fault == ""
    assert [sample.run for sample in rig.samples] == [2]


@pytest.mark.parametrize("phase", ["SLIP", "SETTLE", "RETURN", "DONE"])
def test_when_it_vanishes_after_the_slip_the_run_still_ends(phase: str):
    rig = finished(ScriptedRig(Plan(samples=1), on_corners=blind_in(phase)))
    assert rig.fault == ""
    assert len(rig.samples) == 1


def test_an_arm_that_refuses_every_command_ends_the_session_with_its_reason():
    refuse = ArmReply(accepted=False, reason="joint 3 at its limit")
    rig = finished(
        ScriptedRig(
            Plan(samples=1, faults=3),
            on_reply=lambda reply, _: dataclasses.replace(refuse, run=reply.run, step=reply.step),
        )
    )
    assert rig.fault == "3 runs failed in a row; the last because: joint 3 at its limit"


def test_an_arm_that_never_arrives_is_given_up_after_the_timeout():
    rig = finished(ScriptedRig(Plan(samples=1, faults=2, timeout_s=3.0), on_motion=lambda _report, _rig: None))
    assert "expected the arm to finish its motion within 3 s" in (rig.fault or "")


def test_a_slow_motion_is_awaited_for_as_long_as_it_takes():
    tilt = TiltPlan(steps=1, max_deg=30.0, rate_deg_s=2.0, return_rate_deg_s=4.0)
    rig = finished(ScriptedRig(Plan(samples=1, timeout_s=3.0, tilt=tilt), friction_rad=0.3))
    assert rig.fault == ""
    assert "ABORTED" not in rig.phases()
    assert rig.samples[0].onset_angle_rad == pytest.approx(0.3, abs=math.radians(0.1))


def test_a_motion_that_the_arm_stopped_aborts_the_run_and_the_next_one_goes_on():
    def fail_once(report: MotionReport, rig: ScriptedRig) -> MotionReport:
        fail = report.end_ns and report.step == 4 and report.run == 1
        return dataclasses.replace(report, fault="the arm does not follow") if fail else report

    rig = finished(ScriptedRig(Plan(samples=1), on_motion=fail_once))
    assert [event.reason for event in rig.events if event.phase == "ABORTED"] == ["the arm does not follow"]
    assert [sample.run for sample in rig.samples] == [2]


def test_a_report_of_an_earlier_motion_changes_nothing():
    def echo(report: MotionReport, rig: ScriptedRig) -> MotionReport:
        if report.step > 1:
            rig.give(dataclasses.replace(report, step=report.step - 1, fault="late news"))
        return report

    rig = finished(ScriptedRig(Plan(samples=2), on_motion=echo))
    assert rig.fault == ""
    assert "ABORTED" not in rig.phases()


def test_a_restless_reference_is_refused_repeated_and_at_last_given_up():
    def shake(message: MarkerCorners, rig: ScriptedRig) -> MarkerCorners:
        if rig.machine.phase != "REFERENCE":
            return message
        corners = tuple(value + 4.0 * (-1) ** message.seq for value in message.corners_px)
        return dataclasses.replace(message, corners_px=corners)

    plan = Plan(samples=1, faults=2, reference=ReferencePlan(frames=5, attempts=3))
    rig = finished(ScriptedRig(plan, on_corners=shake))
    assert sum("reference refused" in line and "aborted" not in line for line in rig.lines) == 2 * 3
    assert "reference refused" in (rig.fault or "")


def test_a_tipping_block_is_flagged_and_not_called_a_slip():
    def tip(message: MarkerCorners, rig: ScriptedRig) -> MarkerCorners:
        return dataclasses.replace(message, tipped=rig.tilt_rad > 0.2)

    rig = finished(ScriptedRig(Plan(samples=1), on_corners=tip))
    assert rig.samples[0].flags == ("tipped",)
    assert rig.samples[0].censored
    assert "SLIP" not in rig.phases()


def test_numbers_that_are_none_never_pass_for_a_position():
    def spoil(message: MarkerCorners, _rig: ScriptedRig) -> MarkerCorners:
        if message.seq % 7 == 0:
            return dataclasses.replace(message, corners_px=(math.nan,) * 8)
        return message if message.seq % 11 else dataclasses.replace(message, corners_px=(1.0, 2.0))

    rig = finished(ScriptedRig(Plan(samples=2), on_corners=spoil))
    assert rig.fault == ""
    assert all(np.isfinite(sample.reference_corners_px).all() for sample in rig.samples)
    assert [sample.onset_angle_rad for sample in rig.samples] == pytest.approx([0.3, 0.3], abs=math.radians(0.05))


def test_a_stop_levels_the_plate_and_says_why():
    rig = ScriptedRig(Plan(samples=5))
    rig.run(60.0, until=lambda rig: rig.machine.phase == "TILT" and rig.tilt_rad > 0.1)
    actions = rig.machine.stop("stopped by the user", now_ns=rig.now_ns)
    kinds = [type(action).__name__ for action in actions]
    assert kinds == ["Report", "Tilt", "Finish"]
    assert rig.machine.phase == "FINISHED"


def test_the_same_seed_decides_the_same_and_another_does_not():
    first, again, other = (finished(ScriptedRig(Plan(samples=6, seed=seed)), seconds=300) for seed in (1, 1, 2))
    assert first.commands == again.commands
    assert first.samples == again.samples or repr(first.samples) == repr(again.samples)
    assert [s.direction for s in first.samples] != [s.direction for s in other.samples]


# --- what hangs, and what came before --------------------------------------------------------------------------------


def test_a_session_that_cannot_begin_says_what_it_lacks():
    rig = finished(ScriptedRig(Plan(samples=1, timeout_s=3.0), on_corners=lambda _message, _rig: None))
    assert "expected corners of the marker (camera/corners) within 3 s, got none" in (rig.fault or "")
    assert rig.commands == []


def test_a_slip_whose_attitude_never_comes_is_given_up():
    rig = ScriptedRig(Plan(samples=1, timeout_s=3.0, faults=1, outage_s=1.0))
    rig.run(60.0, until=lambda rig: rig.machine.phase == "SLIP")
    last = rig.commands[-1]
    rig.give(MotionReport(rig.now_ns, last.run, last.step, rig.now_ns, rig.now_ns))
    for _ in range(100):
        rig.now_ns += 50_000_000
        rig.give(Heartbeat(rig.now_ns, armed=True))
    assert "expected the plate's attitude after the slip" in (rig.fault or "")


def test_a_session_that_fails_sends_the_plate_back_to_level():
    def always_fail(report: MotionReport, _rig: ScriptedRig) -> MotionReport:
        return dataclasses.replace(report, fault="it shakes") if report.step == 8 and report.end_ns else report

    rig = finished(ScriptedRig(Plan(samples=1, faults=1, tilt=TiltPlan(adapt_after=0)), on_motion=always_fail))
    assert "it shakes" in (rig.fault or "")
    assert rig.tilt_rad > 0.1
    assert rig.commands[-1].angle_rad == 0.0
    rig.run(10.0, until=lambda rig: rig.command is None)
    assert rig.tilt_rad == 0.0


def test_after_each_fault_in_a_row_it_waits_longer():
    rig = finished(
        ScriptedRig(
            Plan(samples=1, faults=4),
            on_reply=lambda reply, _: dataclasses.replace(reply, accepted=False, reason="no"),
        )
    )
    aborted = [event.stamp_ns * 1e-9 for event in rig.events if event.phase == "ABORTED"]
    assert np.diff(aborted) == pytest.approx([1.0, 2.0, 4.0], abs=0.1)


def test_a_motion_report_of_an_earlier_session_ends_no_motion_of_this_one():
    rig = ScriptedRig(Plan(samples=1))
    rig.run(60.0, until=lambda rig: bool(rig.commands))
    command, old_ns = rig.commands[0], rig.now_ns - 60_000_000_000
    rig.give(MotionReport(old_ns, command.run, command.step, old_ns, old_ns + 1))
    assert "STEP_END" not in [event.phase for event in rig.events]


def test_the_resting_place_is_read_when_the_block_rests():
    rig = finished(ScriptedRig(Plan(samples=2), friction_rad=0.3))
    for sample, done in zip(rig.samples, [e for e in rig.events if e.phase == "DONE"], strict=True):
        returned = max(e.stamp_ns for e in rig.events if e.phase == "STEP_END" and e.run == sample.run)
        assert (done.stamp_ns - returned) * 1e-9 >= 0.19


def test_what_came_before_the_first_heartbeat_is_not_heard():
    rig = ScriptedRig(Plan(samples=1))
    recorded = MarkerCorners(rig.now_ns, 1, (1.0,) * 8, found=True)
    rig.give(recorded)
    rig.give(PlatformState(rig.now_ns))
    rig.give(Heartbeat(rig.now_ns, armed=True))
    assert rig.phases() == []
    for agent in ("camera", "arm"):
        rig.give(ClockOffset(rig.now_ns, agent))
    rig.give(recorded)
    rig.give(PlatformState(rig.now_ns))
    rig.give(Heartbeat(rig.now_ns, armed=True))
    assert rig.phases() == ["SYNC"]


# --- a pause ---------------------------------------------------------------------------------------------------------


def paused_in_first_run(**options: Any) -> ScriptedRig:
    """A rig that is told to pause while its first run tilts the plate."""
    rig = ScriptedRig(Plan(samples=2), **options)
    rig.run(60.0, until=lambda rig: rig.machine.phase == "TILT" and rig.tilt_rad > 0.1)
    rig.give(SessionPause(rig.now_ns, paused=True))
    rig.run(60.0, until=lambda rig: rig.machine.phase == "PAUSED")
    return rig


def test_a_pause_lets_the_run_end_and_keeps_the_next_one_from_beginning():
    rig = paused_in_first_run()
    rig.run(30.0, until=lambda _: False)
    assert rig.machine.phase == "PAUSED"
    assert rig.phases() == ["SYNC", *GOOD_RUN]
    assert rig.tilt_rad == 0.0
    rig.give(SessionPause(rig.now_ns, paused=False))
    assert finished(rig).phases() == ["SYNC", *GOOD_RUN * 2]
    assert rig.fault == ""


def test_a_pause_that_is_taken_back_in_the_same_run_changes_no_decision():
    rig = ScriptedRig(Plan(samples=2))
    rig.run(60.0, until=lambda rig: rig.machine.phase == "TILT")
    for paused in (True, False):
        rig.give(SessionPause(rig.now_ns, paused=paused))
    assert finished(rig).commands == finished(ScriptedRig(Plan(samples=2))).commands


def test_a_run_that_fails_before_a_pause_leaves_the_plate_level():
    def fail_once(report: MotionReport, rig: ScriptedRig) -> MotionReport:
        fail = report.end_ns and rig.tilt_rad > 0.12 and report.run == 1
        return dataclasses.replace(report, fault="the arm does not follow") if fail else report

    rig = paused_in_first_run(on_motion=fail_once)
    assert "ABORTED" in rig.phases()
    rig.run(30.0, until=lambda _: False)
    assert rig.machine.phase == "PAUSED"
    assert rig.tilt_rad == 0.0
    rig.give(SessionPause(rig.now_ns, paused=False))
    assert [sample.run for sample in finished(rig).samples] == [2, 3]


def test_while_it_is_paused_nobody_need_be_heard():
    rig = paused_in_first_run()
    rig.on_corners = lambda _message, _rig: None
    rig.run(60.0, until=lambda _: False)
    rig.on_corners = lambda message, _: message
    rig.run(1.0)
    rig.give(SessionPause(rig.now_ns, paused=False))
    assert finished(rig).fault == ""


# --- whose the arm is ------------------------------------------------------------------------------------------------


def test_a_session_whose_arm_is_taken_over_ends_at_once_and_keeps_no_sample_of_that_run():
    rig = ScriptedRig(Plan(samples=3), owner="mine")
    rig.run(120.0, until=lambda rig: len(rig.samples) == 1 and rig.machine.phase == "TILT" and rig.tilt_rad > 0.1)
    rig.give(ArmLease(rig.now_ns, "mine"))
    assert rig.fault is None
    commands = len(rig.commands)
    rig.give(ArmLease(rig.now_ns, "theirs"))
    assert rig.fault == "another session (theirs) has taken the arm over"
    assert rig.phases()[-1] == "ABORTED"
    rig.run(20.0, until=lambda _: False)
    assert len(rig.samples) == 1
    assert len(rig.commands) == commands
    assert {command.owner for command in rig.commands} == {"mine"}


def test_an_emergency_stop_ends_the_session_and_begins_no_further_run():
    def refuse(reply: ArmReply, rig: ScriptedRig) -> ArmReply:
        return dataclasses.replace(reply, accepted=False, reason="The arm is stopped.") if rig.samples else reply

    rig = ScriptedRig(Plan(samples=3), owner="mine", on_reply=refuse)
    rig.run(120.0, until=lambda rig: bool(rig.samples))
    rig.give(ArmLease(rig.now_ns, "mine", "by hand"))
    rig.run(20.0)
    assert rig.fault == "the arm is stopped (by hand): look at the rig, then start a session to go on"
    assert rig.phases().count("ABORTED") == 1
    rig.run(5.0, until=lambda _: False)
    assert rig.phases()[-1] == "ABORTED"


@pytest.mark.parametrize("phase", ["SYNC", "LEVEL", "DWELL", "REFERENCE", "TILT", "SLIP", "SETTLE", "RETURN", "DONE"])
def test_an_emergency_stop_ends_the_session_in_any_phase_and_asks_nothing_more_of_the_arm(phase: str):
    """One with nothing moving ended nothing: an arm agent that was started anew was commanded by the same session."""
    rig = ScriptedRig(Plan(samples=3), owner="mine")
    rig.run(120.0, until=lambda rig: rig.machine.phase == phase)
    assert rig.machine.phase == phase
    commands = len(rig.commands)
    rig.give(ArmLease(rig.now_ns, "mine", "by hand"))
    rig.give(Heartbeat(rig.now_ns, armed=True, owner="mine"))
    fault = "the arm is stopped (by hand): look at the rig, then start a session to go on"
    assert rig.fault == fault
    assert (rig.phases()[-1], rig.events[-1].reason) == ("ABORTED", fault)
    rig.give(ArmLease(rig.now_ns, "mine"))
    rig.run(20.0, until=lambda _: False)
    assert len(rig.commands) == commands


def test_an_emergency_stop_ends_a_paused_session():
    rig = paused_in_first_run()
    commands = len(rig.commands)
    rig.give(ArmLease(rig.now_ns, "", "by hand"))
    rig.run(1.0)
    assert rig.fault == "the arm is stopped (by hand): look at the rig, then start a session to go on"
    assert len(rig.commands) == commands


def test_a_session_does_not_begin_while_the_arm_is_stopped():
    rig = ScriptedRig(Plan(samples=1), owner="mine")
    rig.give(Heartbeat(rig.now_ns, armed=True, owner="mine"))
    rig.give(ArmLease(rig.now_ns, "mine", "by hand"))
    rig.run(20.0)
    assert rig.fault == "the arm is stopped (by hand): look at the rig, then start a session to go on"
    assert not rig.commands


def test_a_stop_that_was_lifted_before_the_session_began_ends_nothing():
    rig = ScriptedRig(Plan(samples=1), owner="mine")
    rig.give(Heartbeat(rig.now_ns, armed=True, owner="mine"))
    rig.give(ArmLease(rig.now_ns, "mine", "by hand"))
    rig.run(0.5)
    assert not rig.commands
    rig.give(ArmLease(rig.now_ns, "mine"))
    assert finished(rig).fault == ""


# --- frames of now ---------------------------------------------------------------------------------------------------


def good_first(rig: ScriptedRig) -> bool:
    """The first run is under way, somewhere in its tilt."""
    return rig.machine.phase == "TILT" and rig.tilt_rad > 0.1 and not rig.samples


def test_frames_that_are_seconds_old_decide_nothing():
    """The bus hands over, after a cut, what it kept: eight seconds of it, at once."""
    rig = ScriptedRig(Plan(samples=1), friction_rad=0.3)
    kept: list[MarkerCorners] = []
    rig.run(60.0, until=good_first)
    rig.on_corners = lambda message, _: kept.append(message)
    rig.run(8.0, until=lambda _: False)
    commands, events, samples = len(rig.commands), len(rig.events), len(rig.samples)
    moved = [dataclasses.replace(m, corners_px=tuple(v + 40 for v in m.corners_px)) for m in kept]
    for message in moved[: -int(2.0 / 0.01)]:
        rig.give(message)
    assert (len(rig.commands), len(rig.events), len(rig.samples)) == (commands, events, samples)


def test_late_frames_of_a_slide_flag_the_run_and_it_does_not_count():
    rig = ScriptedRig(Plan(samples=1), friction_rad=0.3)
    rig.run(60.0, until=good_first)
    late_ns = rig.now_ns - 3_000_000_000
    rig.give(MarkerCorners(late_ns + 1, 10**6, (1.0,) * 8, found=True, boot_id=5))
    finished(rig)
    assert rig.samples[0].flags == ("disturbed_late_frames", "disturbed_two_cameras")
    assert rig.samples[0].disturbed
    assert [sample.run for sample in rig.samples] == [1, 2]
    assert rig.samples[1].flags == ()
    assert any("run 1 was disturbed" in line for line in rig.lines)


def last_corners(rig: ScriptedRig) -> MarkerCorners:
    """The corners that come next, which the machine hears, too."""
    kept: list[MarkerCorners] = []
    rig.on_corners = lambda message, _: kept.append(message) or message
    rig.run(1.0, until=lambda _: bool(kept))
    rig.on_corners = lambda message, _: message
    return kept[-1]


def test_two_cameras_that_send_at_once_flag_the_run():
    """A copy of the camera agent, or of its keys, sends frames between those of the true one."""
    rig = ScriptedRig(Plan(samples=1), friction_rad=0.3)
    rig.run(60.0, until=good_first)
    last = last_corners(rig)
    for number in range(3):
        for boot_id in (99, last.boot_id):
            rig.give(dataclasses.replace(last, capture_ns=rig.now_ns + number, seq=number, boot_id=boot_id))
    finished(rig)
    assert rig.samples[0].flags == ("disturbed_two_cameras",)
    assert rig.samples[1].flags == ()


def test_a_camera_that_starts_anew_is_one_camera():
    rig = ScriptedRig(Plan(samples=1), friction_rad=0.3)
    rig.on_corners = lambda message, rig: dataclasses.replace(message, boot_id=7 if rig.now_ns < 8e9 else 8)
    assert [sample.flags for sample in finished(rig).samples] == [()]


def test_another_mark_is_not_the_block():
    rig = ScriptedRig(Plan(samples=1), friction_rad=0.3)
    rig.run(60.0, until=good_first)
    last = last_corners(rig)
    away = tuple(one + 40.0 for one in last.corners_px)
    for number in range(20):
        rig.give(dataclasses.replace(last, capture_ns=rig.now_ns + number, corners_px=away, marker_id=3))
    finished(rig)
    assert rig.samples[0].flags == ()
    assert rig.samples[0].onset_angle_rad == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize(("changes", "flags"), [({}, ()), ({"mm_per_px": 0.3}, ("disturbed_calibration",))])
def test_one_calibration_makes_a_sample(changes: dict[str, float], flags: tuple[str, ...]):
    """The camera agent says it again now and then; what changes within a run makes a part of it of another scale."""
    rig = ScriptedRig(Plan(samples=1), friction_rad=0.3)
    rig.run(60.0, until=good_first)
    rig.give(dataclasses.replace(GEOMETRY, stamp_ns=rig.now_ns, **changes))
    assert finished(rig).samples[0].flags == flags


def misread(scale: float) -> CameraGeometry:
    """The plate's map with another scale than the camera sees it in."""
    *rows, g, h, i = GEOMETRY.plate_from_pixel
    plate_from_pixel = (*(scale * one for one in rows), g, h, i)
    return dataclasses.replace(GEOMETRY, plate_from_pixel=plate_from_pixel, mm_per_px=scale * GEOMETRY.mm_per_px)


def test_an_onset_states_what_the_marks_side_tells_of_the_plates_scale():
    """It was 15 standard errors off with a scale that is 5 % off."""
    right, wrong = (finished(ScriptedRig(Plan(samples=1), geometry=misread(one))).samples[0] for one in (1.0, 1.05))
    assert (right.flags, wrong.flags) == ((), ())
    off_rad = abs(wrong.onset_angle_rad - right.onset_angle_rad)
    assert off_rad > 5 * right.onset_sigma_rad
    assert 0.5 * off_rad < wrong.onset_sigma_rad < 3 * off_rad


@pytest.mark.parametrize("friction_rad", [0.3, 0.9])
@pytest.mark.parametrize("scale", [0.6, 1.2])
def test_a_mark_of_another_size_than_is_said_gives_no_sample_and_ends_the_session(scale: float, friction_rad: float):
    """Its runs count nowhere, those in which the block held as little: what is seen may be another mark."""
    plan = Plan(samples=1, faults=2, tilt=TiltPlan(max_deg=30.0))
    rig = finished(ScriptedRig(plan, geometry=misread(scale), friction_rad=friction_rad), seconds=600.0)
    assert ["disturbed_scale" in sample.flags for sample in rig.samples] == [True, True]
    assert [sample.censored for sample in rig.samples] == [friction_rad > 0.5] * 2
    assert f"the mark's side was {abs(scale - 1.0):.0%} off on the plate's map" in str(rig.fault)


@pytest.mark.parametrize(("by_ns", "flags"), [(300_000, ()), (400_000_000, ("disturbed_clock",))])
def test_a_clock_that_is_set_within_a_run_flags_it(by_ns: int, flags: tuple[str, ...]):
    """Frames are placed by the clock's old offset until the new one is known: their times and the tilts' fall apart."""
    rig = ScriptedRig(Plan(samples=1), friction_rad=0.3)
    before = ClockOffset(agent="camera", offset_ns=0, sigma_ns=30_000, rtt_ns=100_000)
    rig.run(1.0, until=lambda _: False)
    rig.give(before)
    rig.run(60.0, until=good_first)
    rig.give(dataclasses.replace(before, offset_ns=by_ns))
    assert finished(rig).samples[0].flags == flags


WALLED = Specimen(opening=Opening(radius_m=0.045), block_area_m2=1e-4)


@pytest.mark.parametrize(("gone_s", "flags"), [(0.02, ()), (0.3, ("disturbed_gap",)), (0.9, ("disturbed_gap",))])
def test_frames_that_are_missing_as_the_block_begins_to_slide_flag_the_run(gone_s: float, flags: tuple[str, ...]):
    began_ns: list[int] = []

    def gone(message: MarkerCorners, rig: ScriptedRig) -> MarkerCorners | None:
        if rig.moving and not rig.samples:
            began_ns.append(rig.now_ns)
        return None if began_ns and not rig.samples and rig.now_ns < began_ns[0] + gone_s * 1e9 else message

    rig = finished(ScriptedRig(Plan(samples=1), friction_rad=0.3, on_corners=gone, specimen=WALLED))
    assert began_ns
    assert rig.samples[0].flags == flags
    assert rig.samples[-1].flags == ()


def test_attitudes_that_are_missing_while_the_block_slides_flag_the_run(monkeypatch: pytest.MonkeyPatch):
    rig = ScriptedRig(Plan(samples=1), friction_rad=0.3)
    rig.run(60.0, until=lambda rig: rig.moving)
    give = rig.give

    def without_attitudes(message: Message) -> None:
        if not isinstance(message, PlatformState):
            give(message)

    with monkeypatch.context() as patched:
        patched.setattr(rig, "give", without_attitudes)
        rig.run(0.3, until=lambda _: False)
    finished(rig)
    assert [sample.flags for sample in rig.samples] == [("disturbed_gap",), ()]


def moved_by(message: MarkerCorners, x_px: float, y_px: float) -> MarkerCorners:
    moves = (x_px, y_px) * 4
    return dataclasses.replace(
        message, corners_px=tuple(place + move for place, move in zip(message.corners_px, moves, strict=True))
    )


@pytest.mark.parametrize(("by_px", "in_s"), [(-30.0, 0.06), (30.0, 0.06), (-100.0, 0.005), (100.0, 0.005)])
def test_what_moves_as_no_block_slides_flags_the_run(by_px: float, in_s: float):
    """The camera is knocked, the block is pushed, or the tracker jumps to another mark, at a tilt of 6 degrees."""
    began_ns: list[int] = []

    def knocked(message: MarkerCorners, rig: ScriptedRig) -> MarkerCorners:
        if rig.samples or (rig.tilt_rad < math.radians(6.0) and not began_ns):
            return message
        began_ns.append(rig.now_ns)
        share = min((rig.now_ns - began_ns[0]) / (in_s * 1e9), 1.0)
        x, y = slide_in_image(rig.commands[-1].azimuth_rad)
        return moved_by(message, by_px * share * x, by_px * share * y)

    rig = finished(ScriptedRig(Plan(samples=1), friction_rad=0.3, on_corners=knocked))
    assert [sample.flags for sample in rig.samples] == [("disturbed_no_slide",), ()]


@pytest.mark.parametrize("flicker", [0.0, 1e-9])
@pytest.mark.parametrize("stuck_s", [0.4, 60.0])
def test_encoders_that_are_stuck_while_the_plate_turns_flag_the_run(
    monkeypatch: pytest.MonkeyPatch, stuck_s: float, flicker: float
):
    rig = ScriptedRig(Plan(samples=1), friction_rad=0.3)
    rig.run(60.0, until=lambda rig: rig.tilt_rad > 0.27)
    give, told, began_ns = rig.give, list[PlatformState](), rig.now_ns

    def stuck(message: Message) -> None:
        if isinstance(message, PlatformState) and not rig.samples and rig.now_ns < began_ns + stuck_s * 1e9:
            told.append(message)
            qw = told[0].qw + flicker * (-1) ** len(told)
            give(dataclasses.replace(told[0], stamp_ns=message.stamp_ns, qw=qw))
        else:
            give(message)

    with monkeypatch.context() as patched:
        patched.setattr(rig, "give", stuck)
        rig.run(60.0, until=lambda rig: bool(rig.samples))
    finished(rig)
    assert "disturbed_encoders" in rig.samples[0].flags
    assert rig.samples[-1].flags == ()


def test_a_sample_that_cannot_be_measured_is_none():
    """A calibration that puts the block a thousand kilometres away would make a sample that nobody can read."""
    a, b, _, *rest = GEOMETRY.plate_from_pixel
    far = dataclasses.replace(GEOMETRY, plate_from_pixel=(a, b, 1e12, *rest))
    rig = ScriptedRig(Plan(samples=1, faults=2), geometry=far)
    rig.run(240.0, until=lambda rig: bool(rig.fault))
    assert not rig.samples
    assert "expected a sample that can be measured" in str(rig.fault)


@pytest.mark.parametrize("phase", ["SETTLE", "RETURN", "DONE"])
def test_a_cut_after_the_slip_flags_the_run_and_it_does_not_count(phase: str):
    def cut(message: MarkerCorners, rig: ScriptedRig) -> MarkerCorners | None:
        return None if rig.machine.phase in (phase, "RETURN", "DONE") and not rig.samples else message

    rig = finished(ScriptedRig(Plan(samples=1, slip=SlipPlan(settle_s=2.0)), on_corners=cut))
    assert [sample.flags for sample in rig.samples] == [("disturbed_cut",), ()]


@pytest.mark.parametrize("stamps", ["go on", "stand still"])
def test_a_frozen_camera_gives_no_run_without_a_slip(stamps: str):
    """Each run ended as "no slip up to this angle" before, and the session looked complete. It waits, level, now."""
    frozen: list[MarkerCorners] = []

    def freeze(message: MarkerCorners, rig: ScriptedRig) -> MarkerCorners:
        if rig.machine.phase == "TILT":
            frozen.append(message)
        if not frozen:
            return dataclasses.replace(message, sigma_px=0.02)
        again = dataclasses.replace(frozen[0], sigma_px=0.02)
        return again if stamps == "stand still" else dataclasses.replace(again, capture_ns=message.capture_ns)

    rig = ScriptedRig(Plan(samples=1, faults=1, timeout_s=3.0), on_corners=freeze)
    rig.run(300.0)
    assert (rig.samples, rig.fault, rig.tilt_rad) == ([], None, 0.0)
    assert "the camera is frozen" in rig.machine.outage
    assert any(line.endswith("waiting, level, for new frames of the camera") for line in rig.lines)
    mend(rig)
    assert finished(rig).fault == ""
    assert [sample.run for sample in rig.samples] == [2]


def test_an_agent_that_says_that_its_camera_is_frozen_is_believed():
    def freeze(message: MarkerCorners, _rig: ScriptedRig) -> MarkerCorners:
        return dataclasses.replace(message, found=False, corners_px=(), reason=REPEATED)

    rig = ScriptedRig(Plan(samples=1, faults=1, timeout_s=3.0))
    rig.run(60.0, until=good_first)
    rig.on_corners = freeze
    rig.run(10.0, until=lambda _: False)
    assert "the camera is frozen" in rig.machine.outage


@pytest.mark.parametrize("says", [{"sigma_px": 0.0}, {"sigma_px": 0.02, "noiseless": True}])
def test_a_camera_without_noise_may_see_the_same_while_the_block_lies_still(says: dict[str, Any]):
    def still(message: MarkerCorners, rig: ScriptedRig) -> MarkerCorners:
        x, y = rig.place_px
        corners = (x - 30, y - 30, x + 30, y - 30, x + 30, y + 30, x - 30, y + 30)
        return dataclasses.replace(message, corners_px=corners, **says)

    rig = finished(ScriptedRig(Plan(samples=2), on_corners=still))
    assert [sample.flags for sample in rig.samples] == [(), ()]
    assert rig.fault == ""


def with_camera_clock(off_ns: int) -> Callable[[MarkerCorners, ScriptedRig], MarkerCorners]:
    return lambda message, _: dataclasses.replace(message, capture_ns=message.capture_ns - off_ns)


def test_a_clock_that_the_station_knows_to_be_hours_off_makes_no_frame_late():
    off_ns = -3 * 3600 * 10**9

    def told(offset: ClockOffset, _: ScriptedRig) -> ClockOffset:
        return dataclasses.replace(offset, offset_ns=off_ns) if offset.agent == "camera" else offset

    rig = finished(ScriptedRig(Plan(samples=1), on_corners=with_camera_clock(off_ns), on_clock=told))
    assert [sample.flags for sample in rig.samples] == [()]


@pytest.mark.parametrize("agent", ["camera", "arm"])
def test_nothing_begins_while_a_clock_is_not_known(agent: str):
    """Frames were taken to be of the station's own clock, and onsets were off by 0.6 degrees, 0.002 stated."""
    rig = ScriptedRig(
        Plan(samples=1, timeout_s=3.0),
        on_corners=with_camera_clock(200_000_000),
        on_clock=lambda offset, _: None if offset.agent == agent else offset,
    )
    assert f"expected answers from {agent}/clock" in (finished(rig).fault or "")
    assert not rig.commands


@pytest.mark.parametrize("agent", ["camera", "arm"])
def test_a_clock_that_answers_no_more_ends_the_run_and_the_session_waits_for_it(agent: str):
    rig = ScriptedRig(Plan(samples=3, dwell=DwellPlan(min_s=2.0, max_s=2.0)), friction_rad=0.3)
    rig.run(60.0, until=lambda rig: bool(rig.samples))
    rig.on_clock = lambda offset, _: None if offset.agent == agent else offset
    rig.run(60.0)
    assert rig.fault is None
    assert "waiting, level, for the " + agent + " agent" in rig.lines
    seen = len(rig.samples)
    rig.run(20.0)
    assert len(rig.samples) == seen
    rig.on_clock = lambda offset, _: offset
    assert finished(rig).fault == ""


@pytest.mark.parametrize(("age_s", "taken"), [(0, True), (86_400, False), (-86_400, False)])
def test_a_reading_of_the_air_is_that_of_its_time(age_s: int, taken: bool):
    rig = ScriptedRig(Plan(samples=1))
    rig.run(1.0)
    for _ in range(2):
        rig.give(Environment(rig.now_ns - age_s * 1_000_000_000, temperature_c=21.5, relative_humidity=0.4))
    (sample,) = finished(rig).samples
    assert (sample.temperature_c == 21.5) == taken
    assert math.isnan(sample.relative_humidity) != taken
    assert sum("the air" in line for line in rig.lines) == (not taken)


def test_a_thermometer_that_has_died_tells_later_runs_nothing():
    rig = ScriptedRig(Plan(samples=12))
    rig.run(1.0)
    rig.give(Environment(rig.now_ns, temperature_c=21.5))
    temperatures = [sample.temperature_c for sample in finished(rig, seconds=600.0).samples]
    assert temperatures[0] == 21.5
    assert math.isnan(temperatures[-1])


# --- long outages ----------------------------------------------------------------------------------------------------


def cut(rig: ScriptedRig, who: str) -> None:
    """Lets nothing of that agent arrive from now on."""
    if who in ("camera", "both"):
        rig.on_corners = lambda _message, _rig: None
    rig.arm_away = who in ("arm", "both")
    if rig.arm_away:
        rig.on_motion = lambda _report, _rig: None


def mend(rig: ScriptedRig) -> None:
    rig.on_corners = lambda message, _: message
    rig.on_motion = lambda report, _: report
    rig.arm_away = False


@pytest.mark.parametrize("who", ["camera", "arm", "both"])
@pytest.mark.parametrize("phase", ["DWELL", "TILT", "RETURN"])
def test_an_outage_of_forty_seconds_costs_one_run_and_no_session(who: str, phase: str):
    rig = ScriptedRig(Plan(samples=3, faults=1))
    rig.run(120.0, until=lambda rig: len(rig.samples) == 1 and rig.machine.phase == phase)
    cut(rig, who)
    rig.run(40.0, until=lambda _: False)
    assert rig.fault is None, rig.fault
    mend(rig)
    finished(rig)
    assert rig.fault == ""
    assert len([sample for sample in rig.samples if not sample.disturbed]) == 3
    assert rig.phases().count("ABORTED") <= 1


def test_an_outage_of_hours_is_waited_for_level():
    rig = ScriptedRig(Plan(samples=1, faults=1))
    rig.run(60.0, until=good_first)
    cut(rig, "camera")
    rig.run(20.0, until=lambda _: False)
    assert rig.tilt_rad == 0.0
    asked = len(rig.commands)
    for _ in range(10_000):  # three hours, second by second
        rig.now_ns += 1_000_000_000
        rig.give(PlatformState(rig.now_ns))
        rig.give(Heartbeat(rig.now_ns, armed=True))
    assert rig.fault is None
    assert len(rig.commands) == asked
    assert sum("waiting, level" in line for line in rig.lines) == 1
    mend(rig)
    assert finished(rig).fault == ""
    assert any("everybody is heard again" in line for line in rig.lines)
    assert rig.phases().count("ABORTED") == 1


def test_a_plan_may_say_how_long_an_outage_is_waited_for():
    rig = ScriptedRig(Plan(samples=1, outage_s=10.0))
    rig.run(60.0, until=good_first)
    cut(rig, "both")
    finished(rig)
    assert "waited 10 s for the camera agent and the arm agent in vain" in (rig.fault or "")


def test_a_marker_that_is_gone_is_no_outage():
    blind = dataclasses.replace
    rig = ScriptedRig(Plan(samples=1, faults=2))
    rig.run(60.0, until=good_first)
    rig.on_corners = lambda message, _: blind(message, found=False, corners_px=(), reason="glare")
    assert "2 runs failed in a row" in (finished(rig).fault or "")


def test_a_geometry_at_its_defaults_is_none_and_leaves_the_slips_unresolved():
    rig = ScriptedRig(Plan(samples=1))
    rig.run(2.0)
    rig.give(CameraGeometry())
    finished(rig)
    assert rig.fault == ""
    assert rig.samples[0].flags == ("onset_unresolved",)
    bare = SamplingMachine(Plan(), size_px=(9, 9), reach=lambda _: 1.0, specimen=Specimen(), geometry=CameraGeometry())
    bare.handle(Heartbeat(1), now_ns=1)
    assert bare.phase == "START"


@pytest.mark.parametrize("away_ns", [3_600_000_000_000, -3_600_000_000_000, 86_400_000_000_000, 2**63 - 1])
def test_an_attitude_of_another_time_changes_no_sample(away_ns: int):
    rig, plain = ScriptedRig(Plan(samples=1)), finished(ScriptedRig(Plan(samples=1)))
    while rig.fault is None:
        rig.run(0.05)
        rig.give(PlatformState(rig.now_ns + away_ns, math.cos(0.7), math.sin(0.7)))
    assert rig.samples == plain.samples


def test_a_motion_that_the_arm_made_by_itself_ends_the_run():
    rig = ScriptedRig(Plan(samples=1, faults=1))
    rig.give(Heartbeat(rig.now_ns, armed=True))
    rig.give(ClockOffset(rig.now_ns, "arm", 0))
    rig.run(60.0, until=good_first)
    rig.give(MotionReport(rig.now_ns, OWN_ORDER, 0, rig.now_ns - 60_000_000_000))
    assert "ABORTED" not in rig.phases()  # the report is of an earlier session
    rig.give(MotionReport(rig.now_ns, OWN_ORDER, 0, rig.now_ns))
    assert rig.phases()[-1] == "ABORTED"
    assert finished(rig).fault == ""
    assert [sample.run for sample in rig.samples] == [2]


def test_a_motion_that_was_held_for_want_of_a_heartbeat_does_not_count_as_a_failure():
    def held_once(report: MotionReport, _rig: ScriptedRig) -> MotionReport:
        held = report.end_ns and report.step == 4 and report.run == 1
        return dataclasses.replace(report, fault="holding", passing=True) if held else report

    rig = finished(ScriptedRig(Plan(samples=1, faults=1), on_motion=held_once))
    assert rig.fault == ""
    assert [sample.run for sample in rig.samples] == [2]
