from __future__ import annotations

import math

import pytest

from station.angles.frames import gravity_of_aeronautical, gravity_of_attitude, mount_rotation, on_plate
from station.angles.reading import (
    Reading,
    inclination,
    message_of_reading,
    reading_of_gravity,
    turn_between,
)
from station.rig.tilt import gravity_in_plate


def tilted(angle_deg: float, azimuth_deg: float = 0.0) -> Reading:
    x, y, z = gravity_in_plate(math.radians(angle_deg), azimuth_rad=math.radians(azimuth_deg)).tolist()
    return reading_of_gravity((x, y, z), stamp_ns=1)


def test_gravity_of_any_length_gives_the_tilt() -> None:
    assert tilted(7.0, 33.0).angle_rad == pytest.approx(math.radians(7.0))


def test_no_gravity_is_no_reading() -> None:
    with pytest.raises(ValueError, match="direction of gravity"):
        reading_of_gravity((0.0, 0.0, 0.0), stamp_ns=1)


def test_a_tilt_the_other_way_is_negative_where_the_direction_is_known() -> None:
    message = message_of_reading(tilted(2.0, 180.0), source="imu")
    assert message.angle_rad == pytest.approx(math.radians(2.0))
    assert inclination(message, azimuth_rad=0.0) == pytest.approx(-math.radians(2.0))


def test_a_sensor_with_one_axis_is_taken_at_its_word() -> None:
    message = message_of_reading(Reading(stamp_ns=1, angle_rad=-0.01), source="gauge")
    assert inclination(message, azimuth_rad=1.0) == -0.01


def test_a_sensor_that_stands_askew_is_put_right_by_its_mount() -> None:
    # Its nose points along the plate's y, and it is mounted 3 degrees nose up.
    mount = mount_rotation((0.0, -3.0, 90.0))
    sensor_level = on_plate(tilted(0.0).gravity or (0.0, 0.0, 0.0), plate_from_sensor=mount.T)
    seen = on_plate(sensor_level, plate_from_sensor=mount)
    assert reading_of_gravity(seen, stamp_ns=1).angle_rad == pytest.approx(0.0, abs=1e-12)
    assert reading_of_gravity(sensor_level, stamp_ns=1).angle_rad == pytest.approx(math.radians(3.0))


def test_right_wing_down_and_nose_up_as_aviators_say_it() -> None:
    # Right wing down: gravity gains a component to the right, which is -y in forward-left-up.
    assert gravity_of_aeronautical(0.1, 0.0)[1] == pytest.approx(-math.sin(0.1))
    # Nose up: gravity points backwards.
    assert gravity_of_aeronautical(0.0, 0.1)[0] == pytest.approx(-math.sin(0.1))


def test_a_level_body_that_is_turned_about_the_vertical_feels_gravity_straight_down() -> None:
    half = math.radians(40.0) / 2
    assert gravity_of_attitude(math.cos(half), 0.0, 0.0, math.sin(half)) == pytest.approx((0.0, 0.0, -1.0))


def test_the_turn_between_readings_counts_direction_too() -> None:
    assert turn_between(tilted(2.0, 0.0), tilted(2.0, 180.0)) == pytest.approx(math.radians(4.0))
    one, other = Reading(stamp_ns=1, angle_rad=0.1), Reading(stamp_ns=2, angle_rad=-0.1)
    assert turn_between(one, other) == pytest.approx(0.2)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_what_is_not_a_number_is_not_finite(bad: float) -> None:
    assert not Reading(stamp_ns=1, angle_rad=bad).finite
    assert not Reading(stamp_ns=1, angle_rad=0.0, gravity=(bad, 0.0, -1.0)).finite
    assert Reading(stamp_ns=1, angle_rad=0.0).finite
