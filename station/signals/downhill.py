"""The angle between slides and the steepest way down, which tells a plate whose axes are not those that are said."""

from __future__ import annotations

import math

import numpy as np

from shared.geometry import Array

DOWNHILL_RAD = math.radians(80.0)
"""The farthest that most blocks slide from the steepest way down. Friction only takes energy, so none slides uphill,
and only grooves that lie all but across the slope take a block farther aside. A wrong axis makes it 90° or 180°.
`pytest tests/unit/diagnosis/test_downhill.py` shows both sides of it."""

LEAST = 1e-12
"""It guards a division."""


def usual_rad(way: Array, down: Array) -> float:
    """Returns the median angle, rad, between slides `way` (n, 2) and ways down `down` (n, 2); 0 without any."""
    if not len(way):
        return 0.0
    length = np.maximum(np.linalg.norm(way, axis=1) * np.linalg.norm(down, axis=1), LEAST)
    return float(np.median(np.arccos(np.clip((way * down).sum(axis=1) / length, -1.0, 1.0))))
