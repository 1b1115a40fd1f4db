"""Misspecification: no law is exact, and with enough runs the difference stands out.

A likelihood that takes laws for exact becomes ever surer of the least wrong one (Miller & Dunson 2019, JASA 114, 1113:
coarsened posteriors). Chance makes a gain of about 1 in twice the log likelihood; a law that gains G leaves one of
about G / KNOWN_TO to others.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Protocol, cast

import numpy as np

from station.diagnosis import thresholds
from station.physics.contact import Array


class Ranked(Protocol):
    """A candidate for one place; it is `unexpected` where it has no law."""

    @property
    def twice_gain(self) -> float: ...  # noqa: D102
    @property
    def twice_log_odds(self) -> float: ...  # noqa: D102
    @property
    def unexpected(self) -> bool: ...  # noqa: D102


def temperature(gains: Iterable[float]) -> float:
    """Gives the divisor of differences in twice the log likelihood between candidates with such gains for one place."""
    return 1.0 + max(gains, default=0.0) / thresholds.KNOWN_TO


def shares(candidates: Sequence[Ranked]) -> Array:
    """Returns the posterior shares (k + 1,) of nothing, which is first, and of each candidate; they add up to 1."""
    heat = temperature(candidate.twice_gain for candidate in candidates)
    # An effect outside the catalogue has no law whose misspecification could be excused.
    heats = np.array([heat, *(1.0 if candidate.unexpected else heat for candidate in candidates)])
    odds = np.array([0.0, *(candidate.twice_log_odds for candidate in candidates)])
    weights = np.exp(0.5 * (odds - odds.max()) / heats)
    return cast(Array, weights / weights.sum())
