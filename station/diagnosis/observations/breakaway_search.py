"""The search for the numbers that make breakaways likeliest: Newton steps, damped where they do not lead upwards."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from station.diagnosis.observations.plate import Times
from station.physics.contact import Array, Bools

REACH = 3.0
"""The farthest step of a number, in its unit or in e-folds: slopes hold only nearby."""

DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-2, 1e-6, 1e8
TIMES_AFTER_GAIN, TIMES_AFTER_LOSS = 0.1, 10.0
"""The damping at first, the least, and that beyond which no step is sought, and its factors after a step (Marquardt
1963, J. SIAM 11, 431)."""

LEAST_CURVATURE = 1e-3
"""The least curvature of a direction, as a share of the complete data's: elsewhere nothing is known of the way up."""


@dataclass(frozen=True, slots=True)
class Effort:
    """A search takes at most `steps` steps, and ends with one that promises less than `least` in log likelihood."""

    steps: int
    least: float


@dataclass(frozen=True, eq=False)
class Sloped:
    """A log likelihood, its slopes (p,), and the information (p, p) of the complete and of the observed data."""

    value: float
    slope: Array
    complete: Array
    observed: Array

    def of(self, indices: Times, units: Array) -> Sloped:
        """Returns the same by the numbers with these indices (f,), in these units (f,)."""
        both, square = np.ix_(indices, indices), np.outer(units, units)
        return Sloped(
            self.value, self.slope[indices] * units, self.complete[both] * square, self.observed[both] * square
        )


def climbed(at: Callable[[Array], Sloped], begin: Array, bounds: Array, effort: Effort) -> tuple[Array, float]:
    """Returns the likeliest numbers (p,) within `bounds` (p, 2) reached from `begin` (p,), and their log likelihood.

    Each number is in its own unit.
    """
    low, high = bounds.T
    here = np.clip(begin, low, high)
    found, damping = at(here), DAMPING
    for _ in range(effort.steps):
        there, promised, damping = _within(found, here, (low, high), damping, effort.least)
        if promised < effort.least:
            break
        tried = at(there)
        if tried.value > found.value:
            here, found, damping = there, tried, max(TIMES_AFTER_GAIN * damping, LEAST_DAMPING)
        else:
            damping = TIMES_AFTER_LOSS * damping
    return here, found.value


def _within(
    found: Sloped, here: Array, bounds: tuple[Array, Array], damping: float, least: float
) -> tuple[Array, float, float]:
    """Returns the end (p,) of the next step, its slopes' promised gain, and the damping with which it promises `least`.

    A step that is cut off at a bound, or where it reaches too far, may lead down. The more it is damped, the more it is
    the slope's own, each number by itself, which leads up however much of it is cut off.
    """
    low, high = bounds
    free = ~((here <= low) & (found.slope < 0.0) | (here >= high) & (found.slope > 0.0))
    while True:
        step = np.zeros(len(here))
        step[free] = _step(found, free, damping)
        there = np.clip(here + np.clip(step, -REACH, REACH), low, high)
        promised = float(found.slope @ (there - here))
        if promised >= least or float(found.slope @ step) < least or damping > MOST_DAMPING:
            return there, promised, damping
        damping = TIMES_AFTER_LOSS * damping


def _step(found: Sloped, free: Bools, damping: float) -> Array:
    """Returns the step of the free numbers (f,) to the maximum of the damped quadratic.

    Directions in which the likelihood is convex are climbed as if they were as concave (Dauphin et al. 2014, NeurIPS).
    """
    scale = 1.0 / np.sqrt(np.maximum(np.diag(found.complete)[free], 1e-9))
    curvature, directions = np.linalg.eigh(found.observed[np.ix_(free, free)] * np.outer(scale, scale))
    curvature = np.maximum(np.abs(curvature), LEAST_CURVATURE) + damping
    return scale * (directions @ ((directions.T @ (scale * found.slope[free])) / curvature))
