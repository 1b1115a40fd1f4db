"""The push of a turning frame on a point that is fixed in it (Landau & Lifshitz, Mechanics, section 39)."""

from __future__ import annotations

import numpy as np

from station.physics.contact import Array


def turned_push(acceleration_rad_s2: Array, rate_rad_s: Array, place_m: Array) -> Array:
    """The push -α x r - ω x (ω x r) per mass, m/s², at the place r, m, from the pivot.

    α, rad/s², ω, rad/s, and r are vectors (3,) or (n, 3) in the same frame; the push has the shape of the largest.
    """
    return -np.cross(acceleration_rad_s2, place_m) - np.cross(rate_rad_s, np.cross(rate_rad_s, place_m))
