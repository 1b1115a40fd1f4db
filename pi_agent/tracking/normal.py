"""The normal distribution, for whole arrays: NumPy has none, and a Pi has no SciPy."""

from functools import lru_cache
from math import erf, sqrt

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

NODES, FARTHEST = 128, 9.0  # places a deviation where `erf` is called, and where the distribution ends


def density(u: Floats) -> Floats:
    """Returns the density (…,) at u (…,)."""
    return np.exp(-0.5 * u * u) / np.sqrt(2 * np.pi)


@lru_cache(maxsize=1)
def _nodes() -> Floats:
    count = round(FARTHEST * NODES)
    return np.array([0.5 * (1.0 + erf(number / NODES / sqrt(2.0))) for number in range(-count, count + 1)])


def cumulative(u: Floats) -> Floats:
    """Returns the distribution (…,) up to u (…,), by its Taylor series about the nearest node: off by less than 1e-15.

    A call of `erf` for every u kept a Pi from its first frame for ten seconds, and an emulated one for two minutes.
    """
    within = np.clip(u, -FARTHEST, FARTHEST)
    number = np.rint(within * NODES)
    a = number / NODES
    h, square = within - a, a * a
    fourth, fifth = a * (3.0 - square) / 24.0, (square * (square - 6.0) + 3.0) / 120.0
    series = h * (1.0 + h * (-0.5 * a + h * ((square - 1.0) / 6.0 + h * (fourth + h * fifth))))
    return _nodes()[(number + FARTHEST * NODES).astype(np.intp)] + density(a) * series


def area(u: Floats) -> Floats:
    """Returns the integral (…,) of `cumulative` up to u (…,)."""
    return u * cumulative(u) + density(u)
