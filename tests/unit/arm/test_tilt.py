"""The tilting convention: the paper's equations, and gravity seen from the plate."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from station.rig.tilt import (
    azimuth_of_direction,
    downhill_in_plate,
    gravity_in_plate,
    steepest_descent,
    tilt_of_rotation,
    tilt_rotation,
    tilting_axis,
)

angles = st.floats(1e-3, math.radians(89))
azimuths = st.floats(0, 2 * math.pi - 1e-6)


@given(angles, azimuths)
def test_the_rotation_turns_about_the_axis_and_tilts_by_the_angle(angle: float, azimuth: float) -> None:
    rotation = tilt_rotation(angle, azimuth_rad=azimuth)
    np.testing.assert_allclose(rotation @ tilting_axis(azimuth), tilting_axis(azimuth), atol=1e-12)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert rotation[2, 2] == pytest.approx(math.cos(angle))


@given(angles, azimuths)
def test_the_steepest_descent_goes_down_by_the_sine_of_the_angle(angle: float, azimuth: float) -> None:
    down = steepest_descent(angle, azimuth_rad=azimuth)
    assert down[2] == pytest.approx(-math.sin(angle))
    np.testing.assert_allclose(
        tilt_rotation(angle, azimuth_rad=azimuth).T @ down, downhill_in_plate(azimuth), atol=1e-12
    )


@given(angles, azimuths)
def test_gravity_in_the_plate_is_the_world_s_gravity_turned(angle: float, azimuth: float) -> None:
    expected = tilt_rotation(angle, azimuth_rad=azimuth).T @ np.array([0, 0, -9.81])
    np.testing.assert_allclose(gravity_in_plate(angle, azimuth_rad=azimuth), expected, atol=1e-11)


@given(angles, azimuths)
def test_angle_and_azimuth_come_back_from_the_rotation(angle: float, azimuth: float) -> None:
    found_angle, found_azimuth = tilt_of_rotation(tilt_rotation(angle, azimuth_rad=azimuth))
    assert found_angle == pytest.approx(angle)
    assert math.remainder(found_azimuth - azimuth, 2 * math.pi) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(("direction", "down"), list(enumerate([(0, -1), (1, 0), (0, 1), (-1, 0)])))
def test_the_four_directions_slide_along_the_plate_s_axes(direction: int, down: tuple[int, int]) -> None:
    np.testing.assert_allclose(downhill_in_plate(azimuth_of_direction(direction))[:2], down, atol=1e-12)


def test_a_level_plate_has_no_azimuth() -> None:
    assert tilt_of_rotation(np.eye(3)) == (0.0, 0.0)


@pytest.mark.parametrize("direction", [-1, 4, 17])
def test_only_four_directions_have_an_azimuth_of_their_own(direction: int) -> None:
    with pytest.raises(ValueError, match="0, 1, 2 or 3"):
        azimuth_of_direction(direction)
