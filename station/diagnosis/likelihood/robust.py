"""Values without the pull of outliers."""

from __future__ import annotations

import numpy as np

from station.physics.contact import Array

GAUSSIAN_MAD = 1.4826
"""A Gaussian's standard deviation over the median of its absolute deviations."""


def clipped(values: Array, reach: float, middle: Array | None = None) -> Array:
    """Gives the values (n,) clipped at `reach` robust standard deviations from their median, or from `middle` (n,)."""
    centre = np.median(values) if middle is None else middle
    spread = reach * (GAUSSIAN_MAD * float(np.median(np.abs(values - centre))))
    return np.clip(values, centre - spread, centre + spread) if spread else values
