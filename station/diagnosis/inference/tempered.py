"""The evidence and the posterior of a model of few numbers, by a sequential Monte Carlo sampler.

Draws from the prior are weighted with the likelihood raised to a power that grows from 0 to 1, as fast as the weights
stay even; after each step they are resampled and moved by Metropolis steps as wide as they lie (Del Moral, Doucet and
Jasra 2006, J. R. Stat. Soc. B 68, 411). The mean weights' product is the evidence. Numbers are sampled as z, Φ(z) being
a number's place between its bounds, so that a flat prior is a standard normal one and no move ends beyond a bound.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp, ndtr

from station.physics.contact import Array

Index = NDArray[np.int64]

DRAWS = 200
"""With so many the log evidence of three numbers scatters by 0.25, little beside the 3 (ln 20) that decide; with 100 by
0.4, with 400 by 0.2 (60 seeds of the first test of `pytest tests/unit/diagnosis/test_tempered.py`; it has no bias)."""

EVEN_SHARE = 0.5
"""The effective share of the draws at which the power stops growing: with 0.3 the evidence scatters by 0.35."""

MOVES, WIDTH = 5, 1.7
"""The number of moves after a step, and a move's standard deviation over the draws' one, for one number; it falls with
the root of how many there are. With 2 moves the evidence scatters by 0.45; widths of 1.0 and 2.4 do no better."""

HALVINGS = 20
"""The search for a step's size ends within a millionth of it."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """The log evidence, and draws (m, k)."""

    log_evidence: float
    draws: Array

    def mean(self) -> Array:
        """Returns the mean (k,) of each number."""
        return self.draws.mean(axis=0)

    def sd(self) -> Array:
        """Returns the standard deviation (k,) of each number."""
        return self.draws.std(axis=0)


def tempered(log_likelihood: Callable[[Array], Array], low: Array, high: Array, rng: np.random.Generator) -> Posterior:
    """Returns the posterior under a flat prior between `low` and `high` (k,).

    `log_likelihood` takes (m, k) and gives (m,).
    """

    def value(points: Array) -> Array:
        return log_likelihood(low + ndtr(points) * (high - low))

    points = rng.normal(size=(DRAWS, len(low)))
    log_value = value(points)
    power, log_evidence = 0.0, 0.0
    while power < 1.0:
        step = _step(log_value, 1.0 - power)
        log_weight = step * log_value
        total = float(np.asarray(logsumexp(log_weight)))
        log_evidence += total - float(np.log(DRAWS))
        power = min(power + step, 1.0)
        kept = _resampled(np.exp(log_weight - total), rng)
        points, log_value = _moved(value, points[kept], log_value[kept], power, rng)
    return Posterior(log_evidence, low + ndtr(points) * (high - low))


def _step(log_value: Array, most: float) -> float:
    """Returns the largest step of the power, up to `most`, that leaves the weights even enough."""

    def even(step: float) -> bool:
        log_weight = step * log_value
        weight = np.exp(log_weight - np.asarray(logsumexp(log_weight)))
        return float(1.0 / (weight @ weight)) >= EVEN_SHARE * len(weight)

    low, high = 0.0, most
    if even(high):
        return high
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if even(middle) else (low, middle)
    return high


def _resampled(weight: Array, rng: np.random.Generator) -> Index:
    """Returns the draws (m,), by their indices, that stand for weighted ones (systematic resampling)."""
    marks = (rng.random() + np.arange(len(weight))) / len(weight)
    return np.minimum(np.searchsorted(np.cumsum(weight), marks), len(weight) - 1).astype(np.int64)


def _moved(
    value: Callable[[Array], Array], points: Array, log_value: Array, power: float, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Returns the draws and their log likelihoods after Metropolis moves, which keep prior × likelihood^power."""
    size = points.shape[1]
    spread = np.atleast_2d(np.cov(points.T)) + 1e-12 * np.eye(size)
    width = WIDTH / np.sqrt(size) * np.linalg.cholesky(spread)
    for _ in range(MOVES):
        there = points + rng.normal(size=points.shape) @ width.T
        log_there = value(there)
        gain = power * (log_there - log_value) + 0.5 * (points**2 - there**2).sum(axis=1)
        taken = np.log(rng.random(len(points))) < gain
        points = np.where(taken[:, None], there, points)
        log_value = np.where(taken, log_there, log_value)
    return points, log_value
