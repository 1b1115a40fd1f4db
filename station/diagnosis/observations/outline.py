"""The distance of a place from a closed outline of straight sides."""

from __future__ import annotations

import numpy as np

from station.physics.contact import Array


def inside_by_m(outline_m: Array, place_m: Array) -> Array:
    """Distance (n,), m, of places (n, 2) inside an outline with corners (k, 2) from its nearest side; negative outside.

    A place is inside if a ray from it crosses an odd number of sides, so the outline may be concave, and its corners
    may follow each other either way round.
    """
    begin, end = outline_m, np.roll(outline_m, -1, axis=0)
    side, off = end - begin, place_m[:, None] - begin
    share = np.clip((off * side).sum(axis=-1) / np.maximum((side * side).sum(axis=-1), 1e-18), 0.0, 1.0)
    away = np.linalg.norm(off - share[..., None] * side, axis=-1).min(axis=1)
    beside = (begin[:, 1] > place_m[:, 1:]) != (end[:, 1] > place_m[:, 1:])
    slope = side[:, 0] / np.where(side[:, 1] == 0.0, 1.0, side[:, 1])
    crossed = beside & (off[..., 0] < off[..., 1] * slope)
    return np.where(crossed.sum(axis=1) % 2 == 1, away, -away)
