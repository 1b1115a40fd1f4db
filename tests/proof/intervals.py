"""Intervals of what is measured on a number of cases."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy.stats import norm

from station.physics.contact import Array

LEVEL = 0.95
DRAWS = 2000
Interval = tuple[float, float]


def wilson(right: int, cases: int, *, level: float = LEVEL) -> Interval:
    """The interval of a share (Wilson 1927, JASA 22, 209); nan without cases."""
    if cases == 0:
        return math.nan, math.nan
    z = float(norm.ppf(0.5 + level / 2))
    share, more = right / cases, z * z / cases
    middle = (share + more / 2) / (1 + more)
    reach = z / (1 + more) * math.sqrt(share * (1 - share) / cases + more / (4 * cases))
    return max(middle - reach, 0.0), min(middle + reach, 1.0)


def bootstrap(
    values: Sequence[float] | Array, statistic: Callable[[Array], float], *, rng: np.random.Generator
) -> Interval:
    """The percentile interval of a statistic of rows (n, …); nan with fewer than two."""
    rows = np.asarray(values, dtype=np.float64)
    if len(rows) < 2:
        return math.nan, math.nan
    drawn = [statistic(rows[rng.integers(0, len(rows), len(rows))]) for _ in range(DRAWS)]
    known = np.array([value for value in drawn if math.isfinite(value)])
    if not len(known):
        return math.nan, math.nan
    low, high = np.quantile(known, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return float(low), float(high)
