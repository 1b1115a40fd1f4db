"""A planned profile in plain numbers is the one that ruckig planned, at every moment."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from ruckig import ControlInterface, InputParameter, Ruckig, Trajectory

from station.arm.profile import profile_of


def planned(*, angle: float, rate: float, acceleration: float, goal: float | None) -> Any:
    """Ruckig's own trajectory to a goal, or to rest wherever that is."""
    request: Any = InputParameter(1)
    request.current_position, request.current_velocity = [angle], [rate]
    request.current_acceleration = [acceleration]
    request.max_velocity, request.max_acceleration, request.max_jerk = [0.3], [1.0], [10.0]
    if goal is None:
        request.control_interface, request.target_velocity = ControlInterface.Velocity, [0.0]
    else:
        request.target_position = [goal]
    trajectory: Any = Trajectory(1)
    Ruckig(1).calculate(request, trajectory)
    return trajectory


@pytest.mark.parametrize("goal", [0.5, 0.1, 0.1001, -0.2, None])
@pytest.mark.parametrize(("rate", "acceleration"), [(0.0, 0.0), (0.2, 0.5), (-0.3, 0.0), (0.5, 0.0), (0.2, 1.5)])
def test_it_is_ruckig_s_at_every_moment(goal: float | None, rate: float, acceleration: float) -> None:
    theirs = planned(angle=0.1, rate=rate, acceleration=acceleration, goal=goal)
    ours = profile_of(theirs)
    assert ours.duration_s == theirs.duration
    times = np.linspace(0.0, theirs.duration, 200)
    wanted = np.array([theirs.at_time(time) for time in times])[..., 0].T
    assert np.array(ours.at(times)) == pytest.approx(wanted, abs=1e-9)
    assert [float(value) for value in ours.at(-1.0)] == pytest.approx(wanted[:, 0], abs=1e-9)
    assert [float(value) for value in ours.at(theirs.duration + 1.0)] == pytest.approx(wanted[:, -1], abs=1e-9)
