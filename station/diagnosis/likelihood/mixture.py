"""Two normal distributions with one spread, fitted by expectation and maximisation from several splits on.

(1 − w) N(y; m, s²) + w N(y; m + d, s²); McLachlan & Peel 2000, Finite mixture models, chapter 2. With one spread the
likelihood has no singularity.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from station.physics.contact import Array, Bools

ROUNDS = 100
"""The most rounds of a fit."""

SETTLED = 1e-3
"""The change of ln L in a round at which a fit ends: what is claimed has hundreds of times as much."""

SPLITS = (0.1, 0.25, 0.5, 0.75, 0.9)
"""The quantiles of the values at which the two kinds begin apart."""

LEAST_SPREAD = 1e-9
"""The least spread that a likelihood is divided by: equal values have none."""

PEAKS = 101
"""The points between the two levels at which a dip of the density is sought."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mixture:
    """The first kind's level, how far the other kind is apart, the other's share, and the spread of both."""

    level: float
    apart: float
    share: float
    spread: float
    log_likelihood: float = -math.inf

    def of_other(self, values: Array) -> Array:
        """Returns the probabilities (n,) that values (n,) are of the other kind."""
        first, second = self.joint(values)
        return np.exp(second - np.logaddexp(first, second))

    def log_density(self, values: Array) -> Array:
        """Returns the log density (n,) of values (n,)."""
        return np.logaddexp(*self.joint(values))

    def has_two_peaks(self) -> bool:
        """Returns true if the density falls and rises again between the two levels."""
        density = self.log_density(self.level + self.apart * np.linspace(0.0, 1.0, PEAKS))
        return bool(np.any((density[1:-1] < density[:-2]) & (density[1:-1] < density[2:])))

    def joint(self, values: Array) -> tuple[Array, Array]:
        """Returns the log densities (n,) of values (n,) of the one kind and of the other, each by its share."""
        scaled, constant = (values - self.level) / self.spread, math.log(self.spread) + 0.5 * math.log(2.0 * math.pi)
        away = self.apart / self.spread
        first = math.log(1.0 - self.share) - 0.5 * scaled**2 - constant
        return first, math.log(self.share) - 0.5 * (scaled - away) ** 2 - constant


def two_normal(values: Array, *, least: float) -> Mixture:
    """Returns the likeliest mixture of values (n,), of which each kind has the share `least`, above 0, or more."""
    cuts = np.quantile(values, SPLITS)
    return max((_climbed(values, values > cut, least) for cut in cuts), key=lambda found: found.log_likelihood)


def _climbed(values: Array, other: Bools, least: float) -> Mixture:
    """Returns the mixture that rounds from a split `other` (n,) of values (n,) lead to."""
    found, before = _maximised(values, np.where(other, 0.99, 0.01), least), -math.inf
    for _ in range(ROUNDS):
        first, second = found.joint(values)
        density = np.logaddexp(first, second)
        total = float(density.sum())
        if total - before < SETTLED:
            break
        before, found = total, _maximised(values, np.exp(second - density), least)
    return replace(found, log_likelihood=before)


def _maximised(values: Array, other: Array, least: float) -> Mixture:
    """Returns the likeliest mixture of values (n,) with these probabilities (n,) of the other kind."""
    share = min(max(float(other.mean()), least), 1.0 - least)
    level = float((1.0 - other) @ values) / max(float((1.0 - other).sum()), LEAST_SPREAD)
    there = float(other @ values) / max(float(other.sum()), LEAST_SPREAD)
    square = (1.0 - other) @ (values - level) ** 2 + other @ (values - there) ** 2
    spread = max(math.sqrt(float(square) / len(values)), LEAST_SPREAD)
    return Mixture(level=level, apart=there - level, share=share, spread=spread)
