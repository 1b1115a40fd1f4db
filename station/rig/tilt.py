"""The one convention of tilting: axes, rotations and the downhill direction (paper, equations 2 to 4).

The world's z (k) is up. When level, the plate's axes are the world's: world_from_plate = 1. A tilt by the angle
alpha >= 0 at the azimuth beta turns the plate about the axis t, which lies in the level plane:

    t = R(k, beta) i                    (2)     tilting_axis
    world_from_plate = R(t, alpha)              tilt_rotation
    n = world_from_plate k              (3)     the plate's normal, in the world
    d = t x n                           (4)     the steepest way down, in the world (d_z = -sin alpha)

t is the same in plate and world, so in the plate frame downhill is t x k = (sin beta, -cos beta, 0), whatever the
angle is, and gravity is g (sin alpha (sin beta, -cos beta, 0) - cos alpha k). Directions 0 to 3 are the azimuths
0, 90, 180 and 270 degrees: the block slides towards the plate's -y, +x, +y and -x.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
DIRECTIONS = 4


def azimuth_of_direction(direction: int) -> float:
    """Returns the azimuth beta in radians of one of the paper's four directions; ValueError for any other number."""
    if direction not in range(DIRECTIONS):
        raise ValueError(f"a direction is 0, 1, 2 or 3, not {direction}")
    return direction * math.pi / 2


def tilting_axis(azimuth_rad: float) -> Array:
    """Returns the unit vector t, (3,), about which the plate turns (equation 2), in the plate as in the world."""
    return np.array([math.cos(azimuth_rad), math.sin(azimuth_rad), 0.0])


def tilt_rotation(angle_rad: float, *, azimuth_rad: float) -> Array:
    """Returns world_from_plate, (3, 3): the turn by `angle_rad` about the tilting axis (Rodrigues)."""
    x, y, _ = tilting_axis(azimuth_rad)
    sine, cosine = math.sin(angle_rad), math.cos(angle_rad)
    rest = 1 - cosine
    return np.array(
        [
            [cosine + x * x * rest, x * y * rest, y * sine],
            [x * y * rest, cosine + y * y * rest, -x * sine],
            [-y * sine, x * sine, cosine],
        ]
    )


def plate_normal(angle_rad: float, *, azimuth_rad: float) -> Array:
    """Returns the plate's normal n in the world, (3,) (equation 3)."""
    return tilt_rotation(angle_rad, azimuth_rad=azimuth_rad)[:, 2]


def steepest_descent(angle_rad: float, *, azimuth_rad: float) -> Array:
    """Returns the steepest way down d in the world, a unit vector (3,) (equation 4)."""
    return np.cross(tilting_axis(azimuth_rad), plate_normal(angle_rad, azimuth_rad=azimuth_rad))


def downhill_in_plate(azimuth_rad: float) -> Array:
    """Returns the steepest way down in the plate frame, a unit vector (3,); it does not depend on the angle."""
    return np.array([math.sin(azimuth_rad), -math.cos(azimuth_rad), 0.0])


def gravity_in_plate(angle_rad: float, *, azimuth_rad: float, gravity_m_s2: float = 9.81) -> Array:
    """Returns gravity in the plate frame, (3,), m/s^2."""
    along = math.sin(angle_rad) * downhill_in_plate(azimuth_rad)
    return gravity_m_s2 * (along - np.array([0.0, 0.0, math.cos(angle_rad)]))


def tilt_of_rotation(world_from_plate: Array) -> tuple[float, float]:
    """Gives angle and azimuth in radians of a plate with `world_from_plate` (3, 3); the azimuth is 0 when it is level.

    Inverse of tilt_rotation, also for a plate that is turned about its own normal: the azimuth then is that of the
    axis in the plate frame.
    """
    down = world_from_plate.T @ np.array([0.0, 0.0, -1.0])
    across = math.hypot(down[0], down[1])
    if across < 1e-12:
        return (0.0 if down[2] < 0 else math.pi), 0.0
    return math.atan2(across, -down[2]), math.atan2(down[0], -down[1]) % (2 * math.pi)
