"""The twin's block takes the exact slider's way after the onset, and stops where it stops."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.simulators import slider
from station.simulators.mujoco.contact import EXACT, Contact
from station.simulators.mujoco.specimen import Friction
from tests.unit.simulators.rides import Profile, Ride, hinge_world, ramp, ride, settle

RETURN_RAD_S = math.radians(15)


def there_and_back(top_rad: float) -> Profile:
    """A ramp of 5°/s to the top, a short hold, and the way back."""
    up, turn_s = ramp(math.radians(5), top_rad=top_rad), top_rad / math.radians(5) + 0.2

    def at(time: float) -> tuple[float, float]:
        if time < turn_s:
            return up(time)
        angle = max(top_rad - RETURN_RAD_S * (time - turn_s), 0.0)
        return angle, -RETURN_RAD_S if angle > 0 else 0.0

    return at


def slide(
    friction: Friction, *, top_rad: float, azimuth_rad: float, yaw_rad: float, contact: Contact = EXACT
) -> tuple[Ride, slider.Slide]:
    world = hinge_world(friction, azimuth_rad=azimuth_rad, contact=contact)
    world.place_block(0.0, 0.0, yaw_rad)
    settle(world)
    seen = ride(world, there_and_back(top_rad), seconds=9, azimuth_rad=azimuth_rad, tick_ns=4_000_000)
    draw = world.friction_now if friction.scatter == 0 else friction.at(friction.mean_angle_rad)
    curve = slider.LimitCurve(mu_along=draw.mu_along, mu_across=draw.mu_across, axis_rad=friction.axis_rad)
    knots = slice(None, None, 4)
    tilt = slider.Tilt(time_s=tuple(seen.time_s[knots]), angle_rad=tuple(seen.tilt_rad[knots]), azimuth_rad=azimuth_rad)
    return seen, slider.simulate(tilt, curve, output_s=0.004)


@pytest.mark.parametrize(("azimuth_rad", "yaw_rad"), [(0.6, 0.0), (0.0, 0.0), (2.0, 0.4)])
def test_a_slide_and_its_stop_on_an_isotropic_pair(azimuth_rad: float, yaw_rad: float) -> None:
    friction = Friction(mean_angle_rad=0.45)
    seen, right = slide(friction, top_rad=0.47, azimuth_rad=azimuth_rad, yaw_rad=yaw_rad)
    moved, should = seen.place_m[-1], right.place_m[-1]
    assert np.linalg.norm(should) > 0.01
    assert np.linalg.norm(moved) == pytest.approx(np.linalg.norm(should), rel=0.03)
    assert turned_deg(moved, should) < 1.0
    assert abs(seen.yaw_rad[-1] - yaw_rad) < math.radians(2)


@pytest.mark.parametrize("yaw_rad", [0.0, 0.2, 0.7])
def test_a_slide_on_an_elliptic_pair_leaves_the_steepest_line_as_it_should(yaw_rad: float) -> None:
    friction = Friction(mean_angle_rad=0.45, ratio=0.7, axis_rad=0.2, fixed_in="plate")
    seen, right = slide(friction, top_rad=0.535, azimuth_rad=0.0, yaw_rad=yaw_rad)
    moved, should = seen.place_m[-1], right.place_m[-1]
    assert np.linalg.norm(should) > 0.01
    assert np.linalg.norm(moved) == pytest.approx(np.linalg.norm(should), rel=0.03)
    assert turned_deg(should, np.array([0.0, -1.0])) > 8
    assert turned_deg(moved, should) < 1.0


def turned_deg(one: np.ndarray, other: np.ndarray) -> float:
    """Angle between two directions in the plate."""
    cross, dot = one[0] * other[1] - one[1] * other[0], one @ other
    return abs(math.degrees(math.atan2(cross, dot)))
