# ruff: noqa: PLR0917 (compiled functions take no keyword-only arguments)
"""Friction that wanders along a slide's path: a random process of each run, not a law that runs share.

Neighbouring windows of a slide have correlated errors: an Ornstein-Uhlenbeck process of the distance, with the
session's size and reach. The moment that turns an uneven sole wanders likewise. Without it a law of the speed or the
place would be fitted to what is random in each run.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from station.diagnosis import thresholds
from station.diagnosis.compiled import compiled
from station.diagnosis.observations.channel import Channel
from station.diagnosis.observations.evidence import Evidence
from station.physics.contact import Array

STEPS = 150
"""The largest number of likelihood evaluations of the simplex search over four numbers."""


@dataclass(frozen=True, slots=True)
class Wander:
    """Standard deviation, in the channel's unit, and correlation length along the path, m."""

    sd: float
    reach_m: float

    def shared(self, apart_m: Array) -> Array:
        """Covariance (n,) of two windows that lie `apart_m` (n,) apart."""
        return self.sd**2 * np.exp(-np.abs(apart_m) / self.reach_m)


def wanders(evidence: Evidence, residuals: Mapping[str, Array]) -> dict[str, Wander]:
    """The wander of each channel that follows a path, by maximum likelihood of its residuals (rows,).

    The course that all runs share, by the order of their windows, is subtracted first: it is a law's. That of rows in
    groups is a part of their noise (`grouped`).
    """
    if evidence.group is not None:
        return {}
    return {
        channel.name: _wander(evidence, channel, residuals[channel.name])
        for channel in evidence.channels
        if channel.travelled_m is not None and len(np.unique(channel.rows.run)) >= thresholds.LEAST_KNOWN
    }


def _wander(evidence: Evidence, channel: Channel, residual: Array) -> Wander:
    order = np.argsort(channel.rows.run, kind="stable")
    order = order[(evidence.counted[channel.rows.run] & ~channel.rows.limit)[order]]
    run, sigma = channel.rows.run[order], channel.rows.sigma[order]
    assert channel.travelled_m is not None
    place = channel.travelled_m[order]
    values = _clipped(_of_its_own(residual[order], run))
    edges = np.append(np.flatnonzero(np.diff(run, prepend=-1)), len(run))
    spread = max(float(np.std(values)), 1e-12)

    def cost(inner: Array) -> float:
        factor, own, sd, reach_m = _numbers(inner, spread)
        return float(_minus_log_likelihood(values, sigma * factor, place, edges, own**2, sd**2, reach_m))

    begin = np.array([0.0, math.log(0.5), math.log(0.3), 0.0])
    corners = np.vstack([begin, begin + np.diag([-1.0, -1.0, -2.0, 1.5])])
    options = {"maxfev": STEPS, "xatol": 0.02, "fatol": 0.02, "initial_simplex": corners}
    found = minimize(cost, begin, method="Nelder-Mead", options=options)
    *_, sd, reach_m = _numbers(np.asarray(found.x), spread)
    return Wander(sd, reach_m)


def _numbers(inner: Array, spread: float) -> tuple[float, float, float, float]:
    """Factor on the error, standard deviations of the run's level and of the wander, and its reach (m), from `inner`.

    `inner` (4,) has logarithms of the first three; the reach is a logistic function within its bounds.
    """
    low, high = math.log(thresholds.SHORTEST_REACH_M), math.log(thresholds.LONGEST_REACH_M)
    share = 1.0 / (1.0 + math.exp(-min(max(float(inner[3]), -30.0), 30.0)))
    factor, own, sd = np.exp(np.clip(inner[:3], -12.0, 12.0)).tolist()
    return factor, spread * own, spread * sd, math.exp(low + share * (high - low))


def _of_its_own(residual: Array, run: NDArray[np.int64]) -> Array:
    """Residuals (n,), ordered by run, less the course that the runs share from window to window.

    The course is the cumulative sum of the median steps, which do not depend on the runs' levels: a run that has fewer
    windows than others leaves no trace where it ends.
    """
    first = np.flatnonzero(np.diff(run, prepend=-1))
    number = np.arange(len(run)) - np.repeat(first, np.diff(np.append(first, len(run))))
    step, after = np.diff(residual)[number[1:] > 0], number[1:][number[1:] > 0]
    steps = np.zeros(int(number.max(initial=0)) + 1)
    for one in np.unique(after):
        mine = step[after == one]
        steps[one] = float(np.median(mine)) if len(mine) >= thresholds.LEAST_KNOWN else 0.0
    return residual - np.cumsum(steps)[number]


def _clipped(values: Array) -> Array:
    middle = float(np.median(values))
    reach = thresholds.WANDER_CLIP * 1.4826 * float(np.median(np.abs(values - middle)))
    return np.clip(values, middle - reach, middle + reach)


@compiled
def _minus_log_likelihood(
    values: Any, sigma: Any, place: Any, edges: Any, own: float, wander: float, reach_m: float
) -> float:
    """Minus the log likelihood of Gaussian runs with a level each and an Ornstein-Uhlenbeck process along the path.

    `own` and `wander` are the variances of the level and of the process; `place` (n,) is the way along the path, m; run
    i has the rows from edges[i] to edges[i + 1].
    """
    total = 0.0
    for run in range(len(edges) - 1):
        first, size = edges[run], edges[run + 1] - edges[run]
        factor = np.zeros((size, size))
        white = np.zeros(size)
        for i in range(size):
            left = values[first + i]
            for j in range(i + 1):
                part = own + wander * np.exp(-abs(place[first + i] - place[first + j]) / reach_m)
                if i == j:
                    part += sigma[first + i] ** 2
                for k in range(j):
                    part -= factor[i, k] * factor[j, k]
                factor[i, j] = np.sqrt(max(part, 1e-30)) if i == j else part / factor[j, j]
                if j < i:
                    left -= factor[i, j] * white[j]
            white[i] = left / factor[i, i]
            total += 0.5 * white[i] ** 2 + np.log(factor[i, i])
    return total
