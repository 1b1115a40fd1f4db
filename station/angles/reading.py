"""One reading of an angle sensor, and the tilt along a commanded direction that it stands for."""

from __future__ import annotations

import math
from dataclasses import dataclass

from shared.messages import AngleReading
from station.rig.tilt import downhill_in_plate

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """The reading of a sensor at `stamp_ns` (the station's clock).

    `angle_rad` is the tilt against level: signed for a sensor with one axis, never negative for one that knows the
    direction of gravity. `gravity` is the unit vector of gravity in the plate frame, None where the sensor cannot
    know it. `sigma_rad` is one reading's standard deviation as the sensor or its maker states it, 0 if not stated.
    `absent` says that the sensor was asked and had no value: its angle is NaN, on the bus too.
    """

    stamp_ns: int
    angle_rad: float
    gravity: Vector | None = None
    sigma_rad: float = 0.0
    absent: bool = False

    @property
    def finite(self) -> bool:
        """True if all of it are numbers."""
        return all(math.isfinite(value) for value in (self.angle_rad, self.sigma_rad, *(self.gravity or ())))


def absent_reading(stamp_ns: int) -> Reading:
    """Returns the answer of a sensor that was asked and has no value."""
    return Reading(stamp_ns=stamp_ns, angle_rad=math.nan, absent=True)


def reading_of_gravity(gravity: Vector, *, stamp_ns: int) -> Reading:
    """Returns the reading of a sensor that knows gravity's direction in the plate frame, of any length but zero.

    Raises:
        ValueError: if the vector has no length.
    """
    x, y, z = gravity
    length = math.sqrt(x * x + y * y + z * z)
    if not (math.isfinite(length) and length > 0):
        raise ValueError(f"expected a direction of gravity, got {gravity}")
    x, y, z = x / length, y / length, z / length
    return Reading(stamp_ns=stamp_ns, angle_rad=math.atan2(math.hypot(x, y), -z), gravity=(x, y, z))


def message_of_reading(reading: Reading, *, source: str) -> AngleReading:
    """Returns the reading as it goes on the bus."""
    x, y, z = reading.gravity or (0.0, 0.0, 0.0)
    return AngleReading(reading.stamp_ns, source, reading.angle_rad, x, y, z, reading.sigma_rad)


def inclination(message: AngleReading, *, azimuth_rad: float) -> float:
    """Returns the signed tilt in radians about the tilting axis at `azimuth_rad` (the paper's beta).

    With gravity known it is atan2(g · downhill, −g_z), which noise near level does not fold over as it folds the
    unsigned tilt; a sensor with one axis is taken at its word.
    """
    x, y, z = message.gravity_x, message.gravity_y, message.gravity_z
    if x == 0.0 and y == 0.0 and z == 0.0:
        return message.angle_rad
    downhill = downhill_in_plate(azimuth_rad)
    return math.atan2(x * float(downhill[0]) + y * float(downhill[1]), -z)


def turn_between(first: Reading, second: Reading) -> float:
    """Returns the angle, rad, by which the plate turned between two readings of one sensor, as far as it can know."""
    if first.gravity is None or second.gravity is None:
        return abs(second.angle_rad - first.angle_rad)
    (ax, ay, az), (bx, by, bz) = first.gravity, second.gravity
    across = math.hypot(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
    return math.atan2(across, ax * bx + ay * by + az * bz)
