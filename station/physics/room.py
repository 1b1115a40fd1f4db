"""The room that a square block has in a round opening."""

from __future__ import annotations

import numpy as np

from station.physics.circle import cos_sin
from station.physics.contact import Array


def room_m(opening_m: float, half_m: Array, pose: tuple[Array, Array, Array]) -> Array:
    """Distance (n,), m, of a square's outermost corner from a circle round the plate's middle, negative beyond it.

    `opening_m` is the circle's radius, `half_m` (n,) half the square's side, `pose` its x, y (m) and yaw (rad), (n,).
    """
    x, y, yaw = pose
    cosine, sine = cos_sin(yaw)
    along, across = np.abs(cosine * x + sine * y), np.abs(cosine * y - sine * x)
    return opening_m - np.hypot(along + half_m, across + half_m)
