"""The sliding direction against the one convention of tilting, and against turned marks."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shared.geometry import block_pose_of, mark_corners, pixels_of_mark
from shared.messages import CameraGeometry
from station.friction import direction
from station.rig import tilt

angles = st.floats(-math.pi, math.pi)
tilts = st.floats(0.01, 1.2)


def turned(yaw_rad: float, *, side: float = 60.0, aspect: float = 1.0) -> np.ndarray:
    """Corners (1, 4, 2) of a mark in a frame with the plate's axes."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return (mark_corners(side_m=side, aspect=aspect) @ np.array([[c, s], [-s, c]]))[None]


def apart(a: float, b: float, *, period: float = 2 * math.pi) -> float:
    return abs((a - b + period / 2) % period - period / 2)


@given(angles, tilts, angles)
def test_the_slide_in_the_world_is_the_tilted_plates_view_of_it(slide: float, alpha: float, beta: float):
    seen = np.array([math.cos(slide), math.sin(slide), 0.0])
    expected = tilt.tilt_rotation(alpha, azimuth_rad=beta) @ seen
    assert direction.sliding_vector(slide, tilt_rad=alpha, azimuth_rad=beta)[0] == pytest.approx(expected, abs=1e-12)


@given(tilts, angles)
def test_straight_down_theta_is_the_inclination(alpha: float, beta: float):
    x, y, _ = tilt.downhill_in_plate(beta)
    s = direction.sliding_vector(math.atan2(y, x), tilt_rad=alpha, azimuth_rad=beta)[0]
    assert s == pytest.approx(tilt.steepest_descent(alpha, azimuth_rad=beta), abs=1e-12)
    theta = direction.angle_of_repose(math.atan2(y, x), tilt_rad=alpha, azimuth_rad=beta)
    assert theta[0] == pytest.approx(alpha, abs=1e-9)


def test_along_the_tilting_axis_there_is_no_slope():
    assert direction.angle_of_repose(0.4, tilt_rad=0.5, azimuth_rad=0.4)[0] == pytest.approx(0.0, abs=1e-12)


def test_a_slide_at_sixty_degrees_from_the_steepest_line_sees_half_the_sine():
    theta = direction.angle_of_repose(-math.pi / 2 + math.pi / 3, tilt_rad=0.5, azimuth_rad=0.0)
    assert math.sin(theta[0]) == pytest.approx(0.5 * math.sin(0.5))
    assert direction.friction_coefficient(theta)[0] == pytest.approx(math.tan(theta[0]))


@given(angles, st.floats(0.3, 3.0))
def test_yaw_is_known_round_the_whole_circle(yaw: float, aspect: float):
    assert apart(float(direction.yaw_of(turned(yaw, aspect=aspect))[0]), yaw) < 1e-9


def test_yaw_is_that_of_the_tracked_pose():
    geometry = CameraGeometry(
        plate_from_pixel=(1 / 6000, 0, -0.05, 0, -1 / 6000, 0.05, 0, 0, 1), marker_side_m=0.01, marker_aspect=1.0
    )
    seen = pixels_of_mark(turned(2.4, side=0.01)[0] + np.array([0.01, -0.02]), geometry)
    _, _, yaw = block_pose_of(tuple(seen.ravel()), geometry)
    found = direction.yaw_of((seen * np.array([1, -1]))[None])[0]
    assert found == pytest.approx(yaw, abs=1e-9)


@pytest.mark.parametrize("aspect", [0.6, 1.7])
@given(yaw=angles)
def test_the_local_axis_lies_along_the_short_side_and_points_along_the_cameras_x(aspect: float, yaw: float):
    shape = direction.mark_shape(turned(yaw, aspect=aspect))
    axis = float(direction.local_x_axis(yaw, short_is_y=shape.short_is_y))
    assert not shape.square
    assert math.cos(axis) >= -1e-9
    assert apart(axis, yaw + (math.pi / 2 if aspect < 1 else 0), period=math.pi) < 1e-9


def test_a_square_mark_has_no_short_side_whatever_the_noise():
    rng = np.random.default_rng(1)
    corners = np.concatenate([turned(0.3)] * 40) + rng.normal(0, 0.3, (40, 4, 2))
    assert direction.mark_shape(corners) == direction.MarkShape(short_is_y=False, square=True)


@given(angles, angles)
def test_a_direction_and_its_opposite_are_one_after_the_mirror(slide: float, axis: float):
    there = float(direction.paper_direction(slide, x_axis_rad=axis))
    back = float(direction.paper_direction(slide + math.pi, x_axis_rad=axis))
    assert 0 <= there <= math.pi
    assert apart(there, back, period=math.pi) < 1e-9


def test_only_what_points_to_negative_y_is_mirrored():
    up, down = (float(direction.paper_direction(s, x_axis_rad=0.2)) for s in (0.2 + 1.0, 0.2 - 1.0))
    assert up == pytest.approx(1.0)
    assert down == pytest.approx(math.pi - 1.0)
