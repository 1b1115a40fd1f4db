"""The push of a turning frame on a point that is fixed in it (Landau & Lifshitz, Mechanics, section 39)."""

from __future__ import annotations

from shared.vectors import cross
from station.physics.contact import Array


def turned_push(acceleration_rad_s2: Array, rate_rad_s: Array, place_m: Array) -> Array:
    """Returns the push -α x r - ω x (ω x r) per mass, m/s², at the place r from the pivot.

    All are in the same frame, and the push has the shape of the largest.

    Args:
        acceleration_rad_s2: (3,) or (n, 3) α, rad/s².
        rate_rad_s: (3,) or (n, 3) ω, rad/s.
        place_m: (3,) or (n, 3) r, m.
    """
    return -cross(acceleration_rad_s2, place_m) - cross(rate_rad_s, cross(rate_rad_s, place_m))
