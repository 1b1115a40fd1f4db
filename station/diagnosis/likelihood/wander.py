# ruff: noqa: PLR0917 (compiled functions take no keyword-only arguments)
"""Friction that wanders along a slide's path: a random process of each run, not a law that runs share.

Neighbouring windows of a slide have correlated errors: a Gaussian process of the distance, with the session's size and
reach. It is rough, an Ornstein-Uhlenbeck process, or smooth, as is what a wide sole averages over its points: a Matern
process of order 3/2, which has a slope (Rasmussen and Williams 2006, Gaussian Processes for Machine Learning, ch. 4).
The likelier one is taken: a rough process that fits the steps from window to window has too little of the waves that
are longer, and two of eight nulls had a law of the speed (.83 and .88; `python -m tests.proof --tier
patch_world/null_nuisance:8 --seed 20261554`). The moment that turns an uneven sole wanders likewise. Without it a law
of the speed or the place would be fitted to what is random in each run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import expit

from station.compiled import compiled
from station.diagnosis import thresholds
from station.diagnosis.likelihood.robust import clipped
from station.diagnosis.observations.channel import Channel
from station.diagnosis.observations.evidence import Evidence
from station.physics.contact import Array

STEPS = 150
"""The largest number of likelihood evaluations of the simplex search over four numbers."""


@dataclass(frozen=True, slots=True)
class Wander:
    """Standard deviation, in the channel's unit, and correlation length along the path, m.

    A `smooth` process has a slope.
    """

    sd: float
    reach_m: float
    smooth: bool = False

    def shared(self, apart_m: Array) -> Array:
        """Returns the covariance (n,) of two windows that lie `apart_m` (n,) apart."""
        apart = np.abs(apart_m) / self.reach_m
        return self.sd**2 * np.exp(-apart) * (1.0 + self.smooth * apart)


def wanders(evidence: Evidence, residuals: Mapping[str, Array]) -> dict[str, Wander]:
    """Returns the wander of each channel that follows a path, by maximum likelihood of its residuals (rows,).

    The course that all runs share, by the order of their windows, is subtracted first: it is a law's. Rows in groups
    have theirs estimated together with their groups' levels (`grouped`).
    """
    return {
        channel.name: _wander(evidence, channel, residuals[channel.name])
        for channel in evidence.channels
        if channel.travelled_m is not None and len(np.unique(channel.rows.run)) >= thresholds.LEAST_KNOWN
    }


def _wander(evidence: Evidence, channel: Channel, residual: Array) -> Wander:
    order = np.argsort(channel.rows.run, kind="stable")
    order = order[evidence.known(channel)[order]]
    run, sigma = channel.rows.run[order], channel.rows.sigma[order]
    assert channel.travelled_m is not None
    place = channel.travelled_m[order]
    values = clipped(_of_its_own(residual[order], run), thresholds.WANDER_CLIP)
    starts = np.diff(run, prepend=-1) != 0
    spread = max(float(np.std(values)), 1e-12)

    def fitted(smooth: bool) -> tuple[float, Wander]:
        def cost(inner: Array) -> float:
            factor, own, sd, reach_m = _numbers(inner, spread)
            rows = (sigma * factor) ** 2
            return float(minus_log_likelihood(values, rows, place, starts, own**2, sd**2, reach_m, smooth))

        begin = np.array([0.0, math.log(0.5), math.log(0.3), 0.0])
        found = simplex(cost, begin, np.array([-1.0, -1.0, -2.0, 1.5]), evaluations=STEPS)
        *_, sd, reach_m = _numbers(found, spread)
        return cost(found), Wander(sd, reach_m, smooth)

    return min((fitted(smooth) for smooth in (False, True)), key=lambda one: one[0])[1]


def _numbers(inner: Array, spread: float) -> tuple[float, float, float, float]:
    """Gives the factor on the error, deviations of the run's level and of the wander, and its reach (m), from `inner`.

    `inner` (4,) has logarithms of the first three; the reach is a logistic function within its bounds.
    """
    low, high = math.log(thresholds.SHORTEST_REACH_M), math.log(thresholds.LONGEST_REACH_M)
    factor, own, sd = np.exp(np.minimum(np.maximum(inner[:3], -12.0), 12.0)).tolist()
    return factor, spread * own, spread * sd, math.exp(low + float(expit(inner[3])) * (high - low))


def _of_its_own(residual: Array, run: NDArray[np.int64]) -> Array:
    """Returns residuals (n,), ordered by run, less the course that the runs share from window to window.

    The course is the cumulative sum of the median steps, which do not depend on the runs' levels: a run that has fewer
    windows than others leaves no trace where it ends. Where too few runs have a step, the last known one goes on.
    """
    first = np.flatnonzero(np.diff(run, prepend=-1))
    number = np.arange(len(run)) - np.repeat(first, np.diff(np.append(first, len(run))))
    step, after = np.diff(residual)[number[1:] > 0], number[1:][number[1:] > 0]
    steps = np.zeros(int(number.max(initial=0)) + 1)
    for one in np.unique(after):
        mine = step[after == one]
        steps[one] = float(np.median(mine)) if len(mine) >= thresholds.LEAST_KNOWN else steps[one - 1]
    return residual - np.cumsum(steps)[number]


def simplex(cost: Callable[[Array], float], begin: Array, steps: Array, *, evaluations: int) -> Array:
    """Returns the numbers (k,) of the least cost by the simplex search (Nelder & Mead 1965, Comput. J. 7, 308).

    Args:
        cost: the cost of numbers (k,).
        begin: (k,) the first corner, in the numbers' own units.
        steps: (k,) how far the other corners are from it, each along one axis, in the same units.
        evaluations: how often the cost may be computed.
    """
    corners = np.vstack([begin, begin + np.diag(steps)])
    options = {"maxfev": evaluations, "xatol": 0.02, "fatol": 0.02, "initial_simplex": corners}
    return np.asarray(minimize(cost, begin, method="Nelder-Mead", options=options).x)


@compiled
def minus_log_likelihood(
    values: Any, rows: Any, place: Any, starts: Any, own: float, wander: float, reach_m: float, smooth: bool
) -> float:
    """Returns minus the log likelihood of values (n,) in runs or groups that begin at `starts`, by a Kalman filter.

    Each has a level and a process along its path; `place` (n,) is the way along it, m. `rows` (n,), `own` and `wander`
    are the variances of rows, levels and the process. The filter is over the process, its slope times the reach, and
    the level (Durbin & Koopman 2012, Time Series Analysis by State Space Methods, ch. 4); a process that is not
    `smooth` has no slope (Hartikainen and Särkkä 2010, IEEE MLSP, 379, for one that is).
    """
    total = 0.0
    w = v = b = p_ww = p_wv = p_wb = p_vv = p_vb = p_bb = 0.0
    slope = wander if smooth else 0.0
    for i in range(len(values)):
        if starts[i]:
            w = v = b = p_wv = p_wb = p_vb = 0.0
            p_ww, p_vv, p_bb = wander, slope, own
        else:
            # The process has the same variance everywhere: what its past does not tell of it is P - F P F'.
            apart = abs(place[i] - place[i - 1]) / reach_m
            kept, bent = np.exp(-apart), apart if smooth else 0.0
            f, g, h = kept * (1.0 + bent), kept * bent, kept * (1.0 - bent)
            w, v = f * w + g * v, h * v - g * w
            d_ww, d_vv = p_ww - wander, p_vv - slope
            p_ww = wander + f * f * d_ww + 2.0 * f * g * p_wv + g * g * d_vv
            p_wv, p_vv = (
                (f * h - g * g) * p_wv + g * h * d_vv - f * g * d_ww,
                slope + h * h * d_vv - 2.0 * g * h * p_wv + g * g * d_ww,
            )
            p_wb, p_vb = f * p_wb + g * p_vb, h * p_vb - g * p_wb
        of_w, of_v, of_b = p_ww + p_wb, p_wv + p_vb, p_wb + p_bb
        variance = of_w + of_b + rows[i] + 1e-30
        left = values[i] - w - b
        total += 0.5 * (left * left / variance + np.log(variance))
        gain = left / variance
        w, v, b = w + of_w * gain, v + of_v * gain, b + of_b * gain
        p_ww, p_wv, p_wb = p_ww - of_w * of_w / variance, p_wv - of_w * of_v / variance, p_wb - of_w * of_b / variance
        p_vv, p_vb, p_bb = p_vv - of_v * of_v / variance, p_vb - of_v * of_b / variance, p_bb - of_b * of_b / variance
    return total
