"""The safety gate: nothing outside the limits passes, whatever comes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from shared.messages import Heartbeat
from station.arm.drivers import JointReading
from station.arm.gate import Action, SafetyGate, Verdict
from station.arm.limits import trajectory_fault
from station.arm.tilt_path import TiltStage, tilt_path
from station.arm.trajectory import JointTrajectory, TiltLimits, TiltState, plan_tilt
from station.rig.arm_settings import ArmSettings, GateSettings
from tests.unit.arm.conftest import TICK_NS, FakeRig

START_NS = 1_000_000_000_000
Array = NDArray[np.float64]


def reading(stage: TiltStage, *, now_ns: int = START_NS, position: Array | None = None) -> JointReading:
    joints = stage.home_rad if position is None else position
    return JointReading(now_ns, stage.model.joint_names, joints, np.zeros(6), np.zeros(6))


def armed_gate(stage: TiltStage) -> SafetyGate:
    gate = SafetyGate(stage, settings=GateSettings(), may_arm=True)
    gate.heartbeat(Heartbeat(START_NS, armed=True), now_ns=START_NS)
    gate.watch(now_ns=START_NS, reading=reading(stage), commanded=None)
    return gate


@pytest.fixture(scope="module")
def good(stage: TiltStage) -> JointTrajectory:
    path = tilt_path(stage, azimuth_rad=0.0)
    return plan_tilt(
        stage.model, path, start=TiltState(), angle_rad=0.05, rate_rad_s=0.1, limits=TiltLimits()
    ).trajectory


def test_a_planned_tilt_passes_when_armed(stage: TiltStage, good: JointTrajectory) -> None:
    assert armed_gate(stage).check(good, now_ns=START_NS, reading=reading(stage)) == ""


def test_what_was_found_right_does_not_excuse_what_was_made_of_it(stage: TiltStage, good: JointTrajectory) -> None:
    """The gate remembers motions by their numbers, so that one that is changed later, in place, is looked at again."""
    gate, position = armed_gate(stage), good.position_rad.copy()
    motion = replace(good, position_rad=position)
    for _ in range(2):
        assert gate.check(motion, now_ns=START_NS, reading=reading(stage)) == ""
    position[len(position) // 2, 3] += 0.5
    for _ in range(2):
        assert "refused" in gate.check(motion, now_ns=START_NS, reading=reading(stage))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300, 99.0])
@pytest.mark.parametrize("field", ["position_rad", "velocity_rad_s"])
def test_one_bad_number_anywhere_is_refused(stage: TiltStage, good: JointTrajectory, field: str, value: float) -> None:
    for sample in (0, len(good.times_ns) // 2, -1):
        values = {"position_rad": good.position_rad.copy(), "velocity_rad_s": good.velocity_rad_s.copy()}
        values[field][sample, 3] = value
        bad = JointTrajectory(times_ns=good.times_ns, **values)
        assert trajectory_fault(bad, stage=stage, settings=GateSettings())


@pytest.mark.parametrize(
    ("times", "said"),
    [
        ([0, 10, 5], "run forward"),
        ([0, 0, 10], "run forward"),
        ([5, 10, 20], "run forward"),
        ([0, 10, 10**15], "0.1 s apart"),
        ([0], "fewer than two"),
        ([], "fewer than two"),
    ],
)
def test_times_must_run_forward_in_small_steps(stage: TiltStage, times: list[int], said: str) -> None:
    still = np.repeat(stage.home_rad[None], len(times), axis=0)
    bad = JointTrajectory(
        times_ns=np.array(times, dtype=np.int64), position_rad=still, velocity_rad_s=np.zeros_like(still)
    )
    assert said in trajectory_fault(bad, stage=stage, settings=GateSettings())


def test_a_wrong_number_of_joints_is_refused(stage: TiltStage, good: JointTrajectory) -> None:
    seven = np.zeros((len(good.times_ns), 7))
    bad = JointTrajectory(times_ns=good.times_ns, position_rad=seven, velocity_rad_s=seven)
    assert "samples of 6 joints" in trajectory_fault(bad, stage=stage, settings=GateSettings())


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"max_tilt_deg": 2.0}, "plate would tilt"),
        ({"velocity_share": 0.1}, "speed"),
        ({"acceleration_share": 0.05}, "acceleration"),
        ({"max_joint_step_deg": 0.5}, "in one motion"),
        ({"pivot_tolerance_m": 1e-14}, "pivot would stray"),
    ],
)
def test_each_limit_refuses_on_its_own(
    stage: TiltStage, good: JointTrajectory, change: dict[str, float], said: str
) -> None:
    assert trajectory_fault(good, stage=stage, settings=GateSettings()) == ""
    assert said in trajectory_fault(good, stage=stage, settings=GateSettings(**change))


def test_a_motion_that_shifts_the_plate_is_refused(stage: TiltStage, good: JointTrajectory) -> None:
    ramp = np.linspace(0, 1, len(good.times_ns))[:, None]
    smooth = 3 * ramp**2 - 2 * ramp**3
    shift = good.position_rad[:1] + smooth * np.array([0.02, 0, 0, 0, 0, 0])
    speed = np.gradient(shift[:, 0], good.times_ns * 1e-9)[:, None] * np.array([1.0, 0, 0, 0, 0, 0])
    speed[[0, -1]] = 0
    bad = JointTrajectory(times_ns=good.times_ns, position_rad=shift, velocity_rad_s=speed)
    assert "pivot would stray" in trajectory_fault(bad, stage=stage, settings=GateSettings())


# --- arming, stopping, heartbeats -------------------------------------------------------------------------------------


def test_the_gate_is_read_only_until_the_station_asks_and_the_rig_allows(
    stage: TiltStage, good: JointTrajectory
) -> None:
    gate = SafetyGate(stage, settings=GateSettings(), may_arm=True)
    gate.watch(now_ns=START_NS, reading=reading(stage), commanded=None)
    assert "no heartbeat" in gate.check(good, now_ns=START_NS, reading=reading(stage))
    gate.heartbeat(Heartbeat(START_NS, armed=False), now_ns=START_NS)
    assert "not armed" in gate.check(good, now_ns=START_NS, reading=reading(stage))
    locked = SafetyGate(stage, settings=GateSettings(), may_arm=False)
    locked.heartbeat(Heartbeat(START_NS, armed=True), now_ns=START_NS)
    assert "read-only" in locked.check(good, now_ns=START_NS, reading=reading(stage))


def test_a_stop_stays_until_the_station_disarms_and_arms(stage: TiltStage, good: JointTrajectory) -> None:
    gate = armed_gate(stage)
    gate.stop("button", now_ns=START_NS)
    gate.heartbeat(Heartbeat(START_NS + 1, armed=True), now_ns=START_NS + 1)
    assert "stopped (button)" in gate.check(good, now_ns=START_NS + 1, reading=reading(stage))
    assert gate.watch(now_ns=START_NS + 1, reading=None, commanded=None).action is Action.HALT
    gate.heartbeat(Heartbeat(START_NS + 2, armed=False), now_ns=START_NS + 2)
    gate.heartbeat(Heartbeat(START_NS + 3, armed=True), now_ns=START_NS + 3)
    assert gate.check(good, now_ns=START_NS + 3, reading=reading(stage)) == ""


def test_a_stopped_arm_does_not_level_when_its_session_ends(stage: TiltStage, good: JointTrajectory) -> None:
    """Disarming alone lifted the stop; six seconds later the plate, with whatever was caught in it, went to level."""
    gate = armed_gate(stage)
    gate.stop("button", now_ns=START_NS)
    gate.heartbeat(Heartbeat(START_NS + 1, armed=False), now_ns=START_NS + 1)
    for after_s in (0.5, 1.5, 7.0, 3600.0):
        now_ns = START_NS + round(after_s * 1e9)
        assert gate.watch(now_ns=now_ns, reading=reading(stage), commanded=None).action is Action.HALT
        assert "stopped (button)" in gate.check(good, now_ns=now_ns, reading=reading(stage), own_order=True)


def test_a_stop_after_an_acknowledged_one_must_be_acknowledged_anew(stage: TiltStage, good: JointTrajectory) -> None:
    gate = armed_gate(stage)
    gate.stop("button", now_ns=START_NS)
    gate.heartbeat(Heartbeat(START_NS + 1, armed=False), now_ns=START_NS + 1)
    gate.stop("button again", now_ns=START_NS + 2)
    gate.heartbeat(Heartbeat(START_NS + 3, armed=True), now_ns=START_NS + 3)
    assert "button again" in gate.check(good, now_ns=START_NS + 3, reading=reading(stage))


def test_a_lost_heartbeat_holds_then_levels(stage: TiltStage) -> None:
    gate = armed_gate(stage)
    seen = [
        gate.watch(now_ns=START_NS + round(after * 1e9), reading=None, commanded=None).action
        for after in (0.5, 0.99, 1.01, 5.9, 6.1, 100)
    ]
    assert seen == [Action.NONE, Action.NONE, Action.HOLD, Action.HOLD, Action.LEVEL, Action.LEVEL]


def test_heartbeats_count_by_their_own_stamp(stage: TiltStage) -> None:
    gate = armed_gate(stage)
    late = START_NS + 2_000_000_000
    gate.heartbeat(Heartbeat(START_NS + 100, armed=True), now_ns=late)  # held up for two seconds: proves nothing
    assert gate.watch(now_ns=late, reading=None, commanded=None).action is Action.HOLD
    gate.heartbeat(Heartbeat(late + 3_600_000_000_000, armed=True), now_ns=late)  # from the future: a wrong clock
    assert gate.watch(now_ns=late, reading=None, commanded=None).action is Action.HOLD
    gate.heartbeat(Heartbeat(late, armed=True), now_ns=late)
    assert gate.watch(now_ns=late, reading=None, commanded=None).action is Action.NONE


def test_an_arm_that_does_not_follow_is_halted_after_the_grace_time(stage: TiltStage) -> None:
    gate = armed_gate(stage)
    off = stage.home_rad + np.array([0, 0, 0.1, 0, 0, 0])
    verdict = None
    actions = []
    for step in range(50):
        now = START_NS + step * TICK_NS
        verdict = gate.watch(now_ns=now, reading=reading(stage, now_ns=now, position=off), commanded=stage.home_rad)
        actions.append(verdict.action)
    assert actions[:30] == [Action.NONE] * 30
    assert actions[30:] == [Action.HALT] * 20
    assert verdict is not None
    assert "joint_3 is 5.7 degrees from where it should be" in verdict.reason


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_senseless_reading_counts_as_not_following(stage: TiltStage, bad: float) -> None:
    gate = armed_gate(stage)
    position = stage.home_rad.copy()
    position[2] = bad
    verdict = None
    for step in range(60):
        now = START_NS + step * TICK_NS
        verdict = gate.watch(
            now_ns=now, reading=reading(stage, now_ns=now, position=position), commanded=stage.home_rad
        )
    assert verdict is not None
    assert verdict.action is Action.HALT


def test_a_silent_arm_is_halted_however_new_its_stamp_claims_to_be(stage: TiltStage) -> None:
    gate = armed_gate(stage)
    frozen = reading(stage, now_ns=START_NS + 10**12)
    verdict = None
    for step in range(60):
        verdict = gate.watch(now_ns=START_NS + step * TICK_NS, reading=frozen, commanded=stage.home_rad)
    assert verdict == Verdict(Action.HALT, "the arm no longer reports its joints")


def test_a_motion_must_begin_where_the_arm_is(stage: TiltStage, good: JointTrajectory) -> None:
    gate = armed_gate(stage)
    elsewhere = reading(stage, position=stage.home_rad + 0.1)
    assert "from where the motion begins" in gate.check(good, now_ns=START_NS, reading=elsewhere)
    assert "does not report" in gate.check(good, now_ns=START_NS, reading=None)
    nonsense = reading(stage, position=np.full(6, math.nan))
    assert gate.check(good, now_ns=START_NS, reading=nonsense)


def test_a_motion_in_place_of_another_must_go_on_from_there(stage: TiltStage, good: JointTrajectory) -> None:
    gate, behind = armed_gate(stage), reading(stage, position=stage.home_rad + 0.1)
    assert gate.check(good, now_ns=START_NS, reading=behind, commanded=stage.home_rad) == ""
    elsewhere = stage.home_rad + 0.1
    assert "from where" in gate.check(good, now_ns=START_NS, reading=reading(stage), commanded=elsewhere)


def test_a_clock_that_steps_back_refuses_and_halts(stage: TiltStage, good: JointTrajectory) -> None:
    gate = armed_gate(stage)
    assert "stepped back" in gate.check(good, now_ns=START_NS - 1, reading=reading(stage))
    assert gate.watch(now_ns=START_NS - 10**9, reading=reading(stage), commanded=None).action is Action.HALT


# --- hostile streams --------------------------------------------------------------------------------------------------

wild = st.one_of(st.floats(allow_nan=True, allow_infinity=True), st.floats(-1.5, 1.5))
matrices = st.integers(0, 8).flatmap(
    lambda count: st.tuples(
        st.lists(st.integers(-(10**12), 10**12), min_size=count, max_size=count),
        st.lists(st.lists(wild, min_size=6, max_size=6), min_size=count, max_size=count),
        st.lists(st.lists(wild, min_size=6, max_size=6), min_size=count, max_size=count),
    )
)


@settings(max_examples=200, deadline=None)
@given(matrices)
def test_random_trajectories_never_pass(
    stage: TiltStage, data: tuple[list[int], list[list[float]], list[list[float]]]
) -> None:
    times, position, velocity = data
    shape = (len(times), 6)
    hostile = JointTrajectory(
        times_ns=np.array(times, dtype=np.int64),
        position_rad=np.array(position, dtype=float).reshape(shape),
        velocity_rad_s=np.array(velocity, dtype=float).reshape(shape),
    )
    assert armed_gate(stage).check(hostile, now_ns=START_NS, reading=reading(stage))


@settings(max_examples=200, deadline=None)
@given(st.floats(-1, 1), st.floats(0.0, 3.0), st.integers(2, 60), st.integers(0, 5))
def test_what_passes_is_inside_the_limits_at_every_moment(
    stage: TiltStage, amount: float, stretch: float, count: int, joint: int
) -> None:
    """Smooth motions of one joint, some fit and some not: whatever the gate lets through is sampled finely."""
    share = np.linspace(0, 1, count)
    smooth = (3 * share**2 - 2 * share**3)[:, None] * (np.arange(6) == joint) * amount * 0.02
    times = np.arange(count, dtype=np.int64) * max(1, round(stretch * 1e7))
    position = stage.home_rad + smooth
    velocity = np.gradient(position, times * 1e-9, axis=0)
    velocity[[0, -1]] = 0
    motion = JointTrajectory(times_ns=times, position_rad=position, velocity_rad_s=velocity)
    if armed_gate(stage).check(motion, now_ns=START_NS, reading=reading(stage)):
        return
    moments = np.linspace(0, motion.duration_ns, 400).astype(int).tolist()
    played = np.array([motion.at(moment) for moment in moments])
    assert (np.abs(played[:, 1]) <= stage.model.max_velocity_rad_s * (1 + 1e-5)).all()
    assert (played[:, 0] >= stage.model.lower_rad - 1e-3).all()
    assert (played[:, 0] <= stage.model.upper_rad + 1e-3).all()


commands = st.tuples(
    st.just("command"),
    st.integers(-3, 6),
    st.one_of(st.floats(allow_nan=True, allow_infinity=True), st.floats(-10, 80)),
    st.one_of(st.floats(allow_nan=True, allow_infinity=True), st.floats(-1, 400)),
    st.one_of(st.floats(allow_nan=True, allow_infinity=True), st.floats(0, 360)),
)
events = st.one_of(
    commands,
    st.tuples(st.just("wait"), st.floats(0.01, 1.5)),
    st.tuples(st.just("silence"), st.floats(0.1, 3.0)),
    st.tuples(st.just("disarm"), st.floats(0.1, 0.3)),
    st.tuples(st.just("stop")),
    st.tuples(st.just("push"), st.floats(-0.2, 0.2)),
    st.tuples(st.just("deaf"), st.floats(0.1, 1.0)),
)


def play(rig: FakeRig, event: tuple[object, ...]) -> None:
    match event:
        case ("command", int(direction), float(angle), float(rate), float(azimuth)):
            rig.command(angle, direction=direction, rate_deg_s=rate, azimuth_deg=azimuth)
        case ("wait", float(seconds)):
            rig.advance(seconds)
        case ("silence", float(seconds)):
            rig.advance(seconds, heartbeat=False)
        case ("disarm", float(seconds)):
            rig.advance(seconds, armed=False)
        case ("push", float(push)):
            rig.disturb = lambda joints: joints + push
            rig.advance(0.5)
            rig.disturb = lambda joints: joints
        case ("deaf", float(seconds)):
            rig.silent = True
            rig.advance(seconds)
            rig.silent = False
        case _:
            rig.stop("test")


@settings(max_examples=40, deadline=None)
@given(st.lists(events, min_size=1, max_size=12))
def test_hostile_streams_never_drive_the_arm_outside_its_limits(
    stage: TiltStage, stream: list[tuple[object, ...]]
) -> None:
    rig = FakeRig(ArmSettings())
    rig.advance(0.2)
    for event in stream:
        play(rig, event)
    rig.advance(0.5)
    sent = np.array([target.position_rad for target in rig.targets]).reshape(-1, 6)
    speeds = np.array([target.velocity_rad_s for target in rig.targets]).reshape(-1, 6)
    assert np.isfinite(sent).all()
    assert (sent >= stage.model.lower_rad).all()
    assert (sent <= stage.model.upper_rad).all()
    assert (np.abs(speeds) <= stage.model.max_velocity_rad_s * 1.00001).all()
    stamps = np.array([target.stamp_ns for target in rig.targets])
    steps = np.abs(np.diff(sent, axis=0)) / np.maximum(np.diff(stamps), TICK_NS)[:, None] * 1e9
    assert (steps <= stage.model.max_velocity_rad_s * 1.01).all()
    moving_ns: int | None = None
    for report in rig.reports:
        if not report.end_ns:
            assert moving_ns is None
            moving_ns = report.begin_ns
        elif report.begin_ns == moving_ns:
            moving_ns = None
        else:  # a command that was accepted, and given up before it began
            assert report.end_ns == report.begin_ns
            assert report.fault
