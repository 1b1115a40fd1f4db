"""A planned motion ends at rest where it should, inside its bounds, without a jump, and as soon as it can.

The judge of "as soon as it can" is ruckig, another planner, where it can be had.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from station.arm.profile import Bounds, Profile, TiltState, profile_to_angle, profile_to_rest

ANYWHERE = st.floats(-1.5, 1.5)
SOME_BOUNDS = st.builds(Bounds, st.floats(0.01, 2.0), st.floats(0.05, 5.0), st.floats(0.5, 50.0))
SHARE = st.floats(-1.0, 1.0)


def moving(bounds: Bounds, rate: float, acceleration: float) -> TiltState:
    """A state at 0.1 rad with those shares of the bounds as its rate and acceleration."""
    return TiltState(
        angle_rad=0.1, rate_rad_s=rate * bounds.rate, acceleration_rad_s2=acceleration * bounds.acceleration
    )


def end_of(profile: Profile) -> list[float]:
    return [float(value) for value in profile.at(profile.duration_s)]


def coasting_rate(start: TiltState, bounds: Bounds) -> float:
    """The rate after the start's acceleration is brought to zero as fast as it can be."""
    now = start.acceleration_rad_s2
    return start.rate_rad_s + now * abs(now) / (2 * bounds.jerk)


def theirs(start: TiltState, bounds: Bounds, goal: float | None) -> Any:
    """Ruckig's trajectory to a goal, or to rest wherever that is."""
    ruckig: Any = pytest.importorskip("ruckig")
    request = ruckig.InputParameter(1)
    request.current_position, request.current_velocity = [start.angle_rad], [start.rate_rad_s]
    request.current_acceleration = [start.acceleration_rad_s2]
    request.max_velocity, request.max_acceleration, request.max_jerk = ([value] for value in bounds)
    if goal is None:
        request.control_interface, request.target_velocity = ruckig.ControlInterface.Velocity, [0.0]
    else:
        request.target_position = [goal]
    trajectory = ruckig.Trajectory(1)
    ruckig.Ruckig(1).calculate(request, trajectory)
    return trajectory


@given(SOME_BOUNDS, SHARE, SHARE, ANYWHERE)
@example(Bounds(0.015625, 3.0, 0.5), 0.0, 1.0, 0.0)  # comes back for two hours at its slow rate
def test_it_ends_at_rest_at_its_angle_inside_its_bounds(
    bounds: Bounds, rate: float, acceleration: float, goal: float
) -> None:
    start = moving(bounds, rate, acceleration)
    profile = profile_to_angle(start, angle_rad=goal, bounds=bounds)
    assert end_of(profile) == pytest.approx([goal, 0.0, 0.0], abs=1e-9)
    _, rates, accelerations = profile.at(np.linspace(0.0, profile.duration_s, 500))
    # A start that gathers speed passes the largest rate before it can be helped.
    unavoidable = max(abs(start.rate_rad_s), abs(coasting_rate(start, bounds)))
    assert np.abs(rates).max() <= max(bounds.rate, unavoidable) + 1e-9
    assert np.abs(accelerations).max() <= bounds.acceleration + 1e-9
    assert np.abs(profile.jerks_rad_s3).max() <= bounds.jerk + 1e-9


@given(SOME_BOUNDS, SHARE, st.floats(-2.0, 2.0), ANYWHERE)
def test_neither_angle_nor_rate_nor_acceleration_jumps(
    bounds: Bounds, rate: float, acceleration: float, goal: float
) -> None:
    """Also from an acceleration beyond the bound, which a motion with higher bounds may have left."""
    profile = profile_to_angle(moving(bounds, rate, acceleration), angle_rad=goal, bounds=bounds)
    states = np.array([profile.angles_rad, profile.rates_rad_s, profile.accelerations_rad_s2])
    for k, begin_s in enumerate(profile.starts_s[1:]):
        before = np.array(profile.at(begin_s * (1 - 1e-15)))
        assert before == pytest.approx(states[:, k + 1], abs=1e-6)


def test_a_motion_to_where_the_plate_rests_already_takes_no_time() -> None:
    start = TiltState(angle_rad=0.3)
    profile = profile_to_angle(start, angle_rad=0.3, bounds=Bounds(0.3, 1.0, 10.0))
    assert profile.duration_s == pytest.approx(0.0, abs=1e-3)
    assert end_of(profile) == pytest.approx([0.3, 0.0, 0.0], abs=1e-9)


@given(SOME_BOUNDS, SHARE, ANYWHERE)
def test_without_acceleration_at_the_start_nobody_plans_a_shorter_motion(
    bounds: Bounds, rate: float, goal: float
) -> None:
    start = moving(bounds, rate, 0.0)
    profile, other = profile_to_angle(start, angle_rad=goal, bounds=bounds), theirs(start, bounds, goal)
    assert profile.duration_s == pytest.approx(other.duration, abs=1e-6)


@pytest.mark.parametrize("goal", [0.5, 0.1, 0.1001, -0.2])
@pytest.mark.parametrize(("rate", "acceleration"), [(0.0, 0.0), (0.2, 0.5), (-0.3, 0.0)])
def test_it_is_ruckig_s_motion_at_every_moment(goal: float, rate: float, acceleration: float) -> None:
    start = TiltState(angle_rad=0.1, rate_rad_s=rate, acceleration_rad_s2=acceleration)
    bounds = Bounds(0.3, 1.0, 10.0)
    profile, other = profile_to_angle(start, angle_rad=goal, bounds=bounds), theirs(start, bounds, goal)
    times = np.linspace(0.0, other.duration, 200)
    wanted = np.array([other.at_time(time) for time in times])[..., 0].T
    assert np.array(profile.at(times))[:2] == pytest.approx(wanted[:2], abs=1e-6)
    assert [float(value) for value in profile.at(-1.0)] == pytest.approx(wanted[:, 0], abs=1e-9)


@given(SOME_BOUNDS, SHARE, st.floats(-2.0, 2.0))
def test_nobody_comes_to_rest_sooner(bounds: Bounds, rate: float, acceleration: float) -> None:
    start = moving(bounds, rate, acceleration)
    profile, other = profile_to_rest(start, bounds=bounds), theirs(start, bounds, None)
    assert profile.duration_s == pytest.approx(other.duration, abs=1e-6)
    assert end_of(profile) == pytest.approx([other.at_time(other.duration)[0][0], 0.0, 0.0], abs=1e-6)
