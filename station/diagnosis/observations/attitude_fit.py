"""The plate's attitude from its readings and its recorded rates together: the readings' noise, and the rates' delay.

Let x(t) be gravity's two components along the plate, and x' what a recorded rate w makes of them, x' = -(w x g). If
both were right, the level e = x - integral of x'(t + d) - y(t) would be constant: d is the delay of the rates, and y
what a filter of theirs has changed besides (rate_filter.py). The readings' noise s is white, and the level is a random
walk by the rates' errors: the local level model (Durbin and Koopman 2012, Time Series Analysis by State Space Methods,
ch. 2).

In its steady state the best level is a mean of the readings with weights w0 phi^|k|, w0 = (1 - phi) / (1 + phi), where
phi predicts each reading best from those before it. The prediction errors have the variance s^2 / phi; s^2 times the
weights is the covariance of the estimated level. Exact rates bring phi near 1, a long mean; readings without noise
bring it near 0, and stay as they are. d is the regression of the prediction errors on those of x' (generalised least
squares), with White's standard error (1980, Econometrica 48, 817).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter

from shared.vectors import cross
from station.diagnosis.observations.rate_filter import answered, weights
from station.physics.contact import Array

GAP = 10.0
"""The rates are not integrated across an interval that is longer than so many median intervals."""

LEAST_UPRIGHT = 0.05
"""The smallest size of gravity's component across the plate: it guards a division on a plate that stands upright."""

ROUNDS, MOST_LOG_ODDS = 8, 12.0
"""ROUNDS steps lead to the delay, each a tenth of what is left or less; MOST_LOG_ODDS bounds phi away from 0 and 1."""

FILTER_ROUNDS = 3
"""The filter and phi are found in turn: a third time changes neither by a hundredth."""


@dataclass(frozen=True, eq=False, kw_only=True)
class AttitudeFit:
    """Gravity and rates (n, 3) in P that agree with each other, and the session's numbers.

    `noise_rad` is a reading's standard deviation and `sigma_rad` (n,) that of the estimated gravity. `keeps` is phi,
    the ratio of a reading's weight to that of its neighbour nearer by. The recorded rates are `delay_s` ± `delay_sd_s`
    late.
    """

    gravity: Array
    rate_rad_s: Array
    sigma_rad: Array
    noise_rad: float
    keeps: float
    delay_s: float
    delay_sd_s: float

    def of_mean(self, weight: Array) -> float:
        """Returns the standard deviation (rad) of the mean over successive readings.

        `weight` (k,) are their weights, which sum to 1.
        """
        apart = np.abs(np.subtract.outer(np.arange(len(weight)), np.arange(len(weight))))
        own = (1.0 - self.keeps) / (1.0 + self.keeps)
        return self.noise_rad * float(np.sqrt(own * (weight @ self.keeps**apart @ weight)))


def fitted(time_s: Array, gravity: Array, rate_rad_s: Array) -> AttitudeFit:
    """Fits gravity and rates to each other.

    Args:
        time_s: (n,) times of the readings, s, ascending; n is 3 or more.
        gravity: (n, 3) unit vectors in P.
        rate_rad_s: (n, 3) recorded rates in P, rad/s.
    """
    parts = _parts(time_s)
    delay_s, sd_s, rate = _delay(time_s, gravity, rate_rad_s, parts)
    level, slopes = _level(time_s, gravity, rate, parts)
    filtered = _filtered(time_s, level, slopes, parts)
    level = level - filtered
    keeps, missed = _predicted(level, parts)
    noise = float(np.sqrt(keeps * np.square(missed).sum() / max(2 * (len(time_s) - len(parts)), 1)))
    smooth, own = _smoothed(level, keeps, parts)
    found = gravity[:, :2] + smooth - level
    upright = np.sqrt(np.maximum(1.0 - (found * found).sum(axis=1), 0.0))
    whole = np.column_stack([found, np.copysign(upright, gravity[:, 2])])
    wrong = _wrong(smooth, slopes[0], time_s, parts)
    return AttitudeFit(
        gravity=whole,
        # The plate keeps them by columns, and so they are not copied there.
        rate_rad_s=np.asfortranarray(rate + _turning(time_s, wrong * smooth + filtered, whole, parts)),
        sigma_rad=noise * np.sqrt(own),
        noise_rad=noise,
        keeps=keeps,
        delay_s=delay_s,
        delay_sd_s=sd_s,
    )


def _parts(time_s: Array) -> list[slice]:
    """Returns the stretches of readings without a gap."""
    step_s = np.diff(time_s)
    ends = np.flatnonzero(step_s > GAP * np.median(step_s)) + 1
    edges = [0, *ends.tolist(), len(time_s)]
    return [slice(first, last) for first, last in pairwise(edges)]


def _delay(time_s: Array, gravity: Array, rate_rad_s: Array, parts: Sequence[slice]) -> tuple[float, float, Array]:
    """Returns the delay of the rates with its standard error, s, and the rates (n, 3) without it."""
    delay_s, sd_s, rate = 0.0, np.inf, rate_rad_s
    for _ in range(ROUNDS):
        level, (slope, _) = _level(time_s, gravity, rate, parts)
        keeps, missed = _predicted(level, parts)
        step_s, sd_s = _regressed(missed, _missed(slope, keeps, parts))
        delay_s += step_s
        rate = np.column_stack([np.interp(time_s + delay_s, time_s, column) for column in rate_rad_s.T])
    return delay_s, sd_s, rate


def _filtered(time_s: Array, level: Array, slopes: tuple[Array, Array], parts: Sequence[slice]) -> Array:
    """Returns the trace of a filter of the rates in the level (n, 2), and x' and x'' (n, 2).

    The trace is without the trapezoid rule's bias.

    A rate whose slope jumps by J within an interval h, at a share f of it, is integrated to J h^2 f (1 - f) / 2 too
    much. x'' grows by J (1 - f) / 2, J / 2 and J f / 2 from reading to reading: the regression is h^2 / 10 with f
    uniform. What is left is shrunk for the rest of the rule's errors, see `_wrong`.
    """
    (slope, bend), step_s = slopes, float(np.median(np.diff(time_s)))
    found = np.zeros_like(level)
    for _ in range(FILTER_ROUNDS):
        keeps, _ = _predicted(level - found, parts)
        weight = weights(_missed(level, keeps, parts), _missed(slope, keeps, parts), step_s)
        found = answered(slope, weight, parts) + 0.1 * step_s**2 * bend
        found *= _wrong(found, slope, time_s, parts)
    return found


def _regressed(values: Array, by: Array) -> tuple[float, float]:
    """Gives the slope of values (n, 2) by others (n, 2), and White's standard error; 0 and inf if the others are 0."""
    known = float((by * by).sum())
    if not known > 0.0:
        return 0.0, np.inf
    slope = float((by * values).sum()) / known
    return slope, float(np.sqrt(np.square(by * (values - slope * by)).sum())) / known


def _level(time_s: Array, gravity: Array, rate: Array, parts: Sequence[slice]) -> tuple[Array, tuple[Array, Array]]:
    """Returns the level (n, 2) of each reading with these rates (n, 3), and x' and x'' (n, 2) by them."""
    slope = -cross(rate, gravity)[:, :2]
    turned = [cumulative_trapezoid(slope[part], time_s[part], axis=0, initial=0.0) for part in parts]
    return gravity[:, :2] - np.concatenate(turned), (slope, _derivative(slope, time_s, parts))


def _predicted(level: Array, parts: Sequence[slice]) -> tuple[float, Array]:
    """Returns the phi that predicts each reading best, and its prediction errors (n, 2)."""
    steps = _steps(level, parts)

    def worse(log_odds: float) -> float:
        missed = _unforeseen(steps, 1.0 / (1.0 + np.exp(-log_odds)))
        return float(np.log(sum(np.vdot(one, one) for one in missed) + 1e-300))

    found = minimize_scalar(worse, bounds=(-MOST_LOG_ODDS, MOST_LOG_ODDS), method="bounded")
    keeps = 1.0 / (1.0 + float(np.exp(-found.x)))
    return keeps, _missed(level, keeps, parts)


def _missed(values: Array, keeps: float, parts: Sequence[slice]) -> Array:
    """Returns the prediction errors (n, 2) of the values, each predicted from those before it."""
    return np.concatenate(_unforeseen(_steps(values, parts), keeps), axis=1).T


def _steps(values: Array, parts: Sequence[slice]) -> list[Array]:
    """Returns the steps (2, m) of the values (n, 2) from reading to reading in each part."""
    return [np.diff(values[part].T, prepend=values[part][:1].T) for part in parts]


def _unforeseen(steps: Sequence[Array], keeps: float) -> list[Array]:
    """Returns the prediction errors (2, m) in each part."""
    return [np.asarray(lfilter([1.0], [1.0, -keeps], step), dtype=np.float64) for step in steps]


def _smoothed(level: Array, keeps: float, parts: Sequence[slice]) -> tuple[Array, Array]:
    """Returns the two-sided means (n, 2) of the values, and the weight (n,) of each value in its own mean."""

    def both(values: Array) -> Array:
        sides = (lfilter([1.0], [1.0, -keeps], each, axis=0) for each in (values, values[::-1]))
        return next(sides) + next(sides)[::-1] - values

    own = np.concatenate([1.0 / both(np.ones(part.stop - part.start)) for part in parts])
    return np.concatenate([both(level[part]) for part in parts]) * own[:, None], own


def _wrong(level: Array, slope: Array, time_s: Array, parts: Sequence[slice]) -> float:
    """Returns the share of the level's variance that the rates' errors explain; the trapezoid rule explains the rest.

    Where an acceleration jumps by J within an interval h, the trapezoid errs by J h^2 f (1 - f) / 2, with f uniform
    from 0 to 1, and the second differences of the slopes are J h f and J h (1 - f): 80 times the mean square of the
    former is h^2 times that of the latter. The share is that of James and Stein's estimator, and not below 0.
    """
    wandered = sum(float(np.square(np.diff(level[part], axis=0)).sum()) for part in parts)
    bent = sum(float(np.square(np.diff(slope[part], n=2, axis=0)).sum()) for part in parts)
    added_up = float(np.median(np.diff(time_s))) ** 2 * bent / 80.0
    return max(1.0 - added_up / wandered, 0.0) if wandered > 0.0 else 0.0


def _turning(time_s: Array, level: Array, gravity: Array, parts: Sequence[slice]) -> Array:
    """Returns the rates (n, 3) that the level's drift implies and the recorded ones lack.

    A turn about gravity is unseen.
    """
    along = _derivative(level, time_s, parts)
    upright = np.copysign(np.maximum(np.abs(gravity[:, 2]), LEAST_UPRIGHT), gravity[:, 2])
    across = -(along * gravity[:, :2]).sum(axis=1) / upright
    return cross(np.column_stack([along, across]), gravity)


def _derivative(values: Array, time_s: Array, parts: Sequence[slice]) -> Array:
    """Returns the time derivative (n, 2) of values (n, 2); 0 in a stretch of one reading."""
    made = np.zeros_like(values)
    for part in parts:
        if part.stop - part.start > 1:
            made[part] = np.gradient(values[part], time_s[part], axis=0)
    return made
