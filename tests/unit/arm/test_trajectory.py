"""Smooth motions: inside every limit, at rest at the end, and continued without a jolt."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shared.errors import UserError
from station.arm.limits import extremes, trajectory_fault
from station.arm.tilt_path import TiltPath, TiltStage, tilt_path
from station.arm.trajectory import JointTrajectory, TiltLimits, TiltState, plan_rest, plan_tilt
from station.rig.arm_settings import GateSettings

LIMITS = TiltLimits()


@pytest.fixture(scope="module")
def path(stage: TiltStage) -> TiltPath:
    return tilt_path(stage, azimuth_rad=math.pi * 3 / 2)


@settings(max_examples=60, deadline=None)
@given(st.floats(0, 67.5), st.floats(0, 67.5), st.floats(0.2, 500))
def test_any_motion_along_the_path_passes_the_gate_s_limits(
    stage: TiltStage, path: TiltPath, start_deg: float, goal_deg: float, rate_deg_s: float
) -> None:
    motion = plan_tilt(
        stage.model,
        path,
        start=TiltState(angle_rad=math.radians(start_deg)),
        angle_rad=math.radians(goal_deg),
        rate_rad_s=math.radians(rate_deg_s),
        limits=LIMITS,
    )
    assert trajectory_fault(motion.trajectory, stage=stage, settings=GateSettings()) == ""
    np.testing.assert_allclose(
        motion.trajectory.position_rad[-1], path.at(np.array([math.radians(goal_deg)]))[0][0], atol=1e-9
    )
    assert not motion.trajectory.velocity_rad_s[-1].any()


def test_the_tilt_keeps_its_own_rate_and_jerk_limits(stage: TiltStage, path: TiltPath) -> None:
    motion = plan_tilt(stage.model, path, start=TiltState(), angle_rad=0.5, rate_rad_s=0.1, limits=LIMITS)
    states = [motion.state(t) for t in range(0, motion.trajectory.duration_ns, 1_000_000)]
    rates = np.array([state.rate_rad_s for state in states])
    accelerations = np.array([state.acceleration_rad_s2 for state in states])
    assert rates.max() == pytest.approx(0.1)
    assert np.abs(accelerations).max() <= LIMITS.max_acceleration_rad_s2 + 1e-9
    assert np.abs(np.diff(accelerations)).max() / 1e-3 <= LIMITS.max_jerk_rad_s3 * 1.01


def test_a_motion_is_taken_over_in_mid_flight_without_a_jolt(stage: TiltStage, path: TiltPath) -> None:
    first = plan_tilt(stage.model, path, start=TiltState(), angle_rad=0.5, rate_rad_s=0.1, limits=LIMITS)
    handover = 1_234_000_000
    back = plan_tilt(stage.model, path, start=first.state(handover), angle_rad=0.0, rate_rad_s=0.1, limits=LIMITS)
    np.testing.assert_allclose(back.trajectory.at(0)[0], first.trajectory.at(handover)[0], atol=1e-6)
    np.testing.assert_allclose(back.trajectory.at(0)[1], first.trajectory.at(handover)[1], atol=1e-4)
    assert back.state(back.trajectory.duration_ns).angle_rad == pytest.approx(0, abs=1e-9)


def test_coming_to_rest_takes_a_fraction_of_a_second(stage: TiltStage, path: TiltPath) -> None:
    moving = TiltState(angle_rad=0.4, rate_rad_s=0.1)
    rest = plan_rest(path, start=moving, limits=LIMITS)
    end = rest.state(rest.trajectory.duration_ns)
    assert end.rate_rad_s == pytest.approx(0, abs=1e-9)
    assert 0.4 < end.angle_rad < 0.42
    assert trajectory_fault(rest.trajectory, stage=stage, settings=GateSettings()) == ""


def test_the_curve_between_samples_is_what_the_limits_look_at() -> None:
    """Two samples within the limits whose cubic overshoots: the vertex must be found."""
    overshoot = JointTrajectory(
        times_ns=np.array([0, 1_000_000_000]),
        position_rad=np.array([[0.0], [0.0]]),
        velocity_rad_s=np.array([[1.0], [1.0]]),
    )
    speed, acceleration = extremes(overshoot)
    fine = np.array([overshoot.at(t)[1][0] for t in range(0, 1_000_000_000, 1_000_000)])
    assert speed[0] == pytest.approx(np.abs(fine).max(), rel=1e-3)
    assert acceleration[0] == pytest.approx(np.abs(np.diff(fine)).max() / 1e-3, rel=1e-2)


@pytest.mark.parametrize(("angle", "rate"), [(math.nan, 0.1), (0.1, math.nan), (0.1, 0.0), (0.1, -1.0), (math.inf, 1)])
def test_senseless_requests_are_refused(stage: TiltStage, path: TiltPath, angle: float, rate: float) -> None:
    with pytest.raises(UserError, match="Expected a finite angle"):
        plan_tilt(stage.model, path, start=TiltState(), angle_rad=angle, rate_rad_s=rate, limits=LIMITS)


@pytest.mark.parametrize("rate", [1e-4, 1e-7, 1e-300])
def test_a_motion_without_end_is_refused_before_it_fills_the_memory(
    stage: TiltStage, path: TiltPath, rate: float
) -> None:
    with pytest.raises(UserError, match="Expected a tilt that ends within 600 s"):
        plan_tilt(stage.model, path, start=TiltState(), angle_rad=0.5, rate_rad_s=rate, limits=LIMITS)


def test_an_arm_that_would_swing_round_is_refused(stage: TiltStage, path: TiltPath) -> None:
    small = TiltLimits(max_travel=2.0)
    with pytest.raises(UserError, match="swing the arm round"):
        plan_tilt(stage.model, path, start=TiltState(), angle_rad=1.1, rate_rad_s=0.1, limits=small)
