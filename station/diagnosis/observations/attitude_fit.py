"""The plate's attitude from its readings and its recorded rates together: the readings' noise, and the rates' delay.

Let x(t) be gravity's two components along the plate, and x' what a recorded rate w makes of them, x' = -(w x g), less
the rate's noise (rate_noise.py). If both were right, the level e = x - integral of x' - y(t) would be constant, with
rates that were late by d, or lagged by d (rate_lag.py), and y what a filter of theirs has changed besides
(rate_filter.py). The readings' noise s is white, and the level is a random walk by the rates' errors: the local level
model (Durbin and Koopman 2012, Time Series Analysis by State Space Methods, ch. 2).

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
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter

from shared.vectors import cross
from station.diagnosis.observations.cubics import spline_integral
from station.diagnosis.observations.rate_filter import answered, weights
from station.diagnosis.observations.rate_lag import FORMS, Form, derivative
from station.diagnosis.observations.rate_noise import without_noise
from station.physics.contact import Array

GAP = 10.0
"""The rates are not integrated across an interval that is longer than so many median intervals."""

LEAST_UPRIGHT = 0.05
"""The smallest size of gravity's component across the plate: it guards a division on a plate that stands upright."""

ROUNDS, MOST_LOG_ODDS = 8, 12.0
"""ROUNDS steps lead to the delay, each a tenth of what is left or less; MOST_LOG_ODDS bounds phi away from 0 and 1."""

JUMPS = 171.0
"""The second differences of a broken line by the errors of its spline's integral, both squared, at an interval of 1
(`pytest tests/unit/diagnosis/test_attitude_fit.py` draws such lines)."""

FILTER_ROUNDS = 3
"""The filter and phi are found in turn: a third time changes neither by a hundredth."""


@dataclass(frozen=True, eq=False, kw_only=True)
class AttitudeFit:
    """Gravity and rates (n, 3) in P that agree with each other, and the session's numbers.

    `noise_rad` is a reading's standard deviation and `sigma_rad` (n,) that of the estimated gravity. `keeps` is phi,
    the ratio of a reading's weight to that of its neighbour nearer by. The recorded rates are `delay_s` ± `delay_sd_s`
    late. With `by_readings` no rates were recorded, or none that agree with the readings (`rate_of_readings`).
    """

    gravity: Array
    rate_rad_s: Array
    sigma_rad: Array
    noise_rad: float
    keeps: float
    delay_s: float
    delay_sd_s: float
    by_readings: bool = False

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
    parts, quiet = parts_of(time_s), without_noise(rate_rad_s)
    late = min((_late(form, time_s, gravity, quiet, parts) for form in FORMS), key=lambda one: one.missed)
    level, slope = _level(time_s, gravity, late.rate, parts)
    filtered = _filtered(time_s, level, slope, parts)
    level = level - filtered
    keeps, missed = _predicted(level, parts)
    noise = float(np.sqrt(keeps * np.square(missed).sum() / max(2 * (len(time_s) - len(parts)), 1)))
    smooth, own = _smoothed(level, keeps, parts)
    found = gravity[:, :2] + smooth - level
    upright = np.sqrt(np.maximum(1.0 - (found * found).sum(axis=1), 0.0))
    whole = np.column_stack([found, np.copysign(upright, gravity[:, 2])])
    wrong = _wrong(smooth, slope, time_s, parts)
    return AttitudeFit(
        gravity=whole,
        rate_rad_s=late.rate + _turning(time_s, wrong * smooth + filtered, whole, parts),
        sigma_rad=noise * np.sqrt(own),
        noise_rad=noise,
        keeps=keeps,
        delay_s=late.delay_s,
        delay_sd_s=late.sd_s,
    )


def parts_of(time_s: Array) -> list[slice]:
    """Returns the stretches of readings without a gap, by their times `time_s` (n,), s."""
    step_s = np.diff(time_s)
    ends = np.flatnonzero(step_s > GAP * np.median(step_s)) + 1
    edges = [0, *ends.tolist(), len(time_s)]
    return [slice(first, last) for first, last in pairwise(edges)]


@dataclass(frozen=True, eq=False)
class _Late:
    """A form of late rates: its delay and standard error, s, the rates (n, 3) without it, and the squares they miss."""

    delay_s: float
    sd_s: float
    rate: Array
    missed: float


def _late(form: Form, time_s: Array, gravity: Array, recorded: Array, parts: Sequence[slice]) -> _Late:
    delay_s, sd_s, left = 0.0, np.inf, np.inf
    for _ in range(ROUNDS):
        rate, by_delay = form(time_s, recorded, delay_s, parts)
        level, _ = _level(time_s, gravity, rate, parts)
        keeps, missed = _predicted(level, parts)
        step_s, sd_s = _regressed(missed, _missed(-cross(by_delay, gravity)[:, :2], keeps, parts))
        delay_s, left = delay_s + step_s, float(np.square(missed).sum())
    return _Late(delay_s, sd_s, form(time_s, recorded, delay_s, parts)[0], left)


def _filtered(time_s: Array, level: Array, slope: Array, parts: Sequence[slice]) -> Array:
    """Returns the trace (n, 2) of a filter of the rates in the level (n, 2), by x' (n, 2).

    It is shrunk for what the integration may have added, see `_wrong`.
    """
    step_s = float(np.median(np.diff(time_s)))
    found = np.zeros_like(level)
    for _ in range(FILTER_ROUNDS):
        keeps, _ = _predicted(level - found, parts)
        found = answered(slope, weights(_missed(level, keeps, parts), _missed(slope, keeps, parts), step_s), parts)
        found *= _wrong(found, slope, time_s, parts)
    return found


def _regressed(values: Array, by: Array) -> tuple[float, float]:
    """Gives the slope of values (n, 2) by others (n, 2), and White's standard error; 0 and inf if the others are 0."""
    known = float((by * by).sum())
    if not known > 0.0:
        return 0.0, np.inf
    slope = float((by * values).sum()) / known
    return slope, float(np.sqrt(np.square(by * (values - slope * by)).sum())) / known


def _level(time_s: Array, gravity: Array, rate: Array, parts: Sequence[slice]) -> tuple[Array, Array]:
    """Returns the level (n, 2) of each reading with these rates (n, 3), and x' (n, 2) by them."""
    slope = -cross(rate, gravity)[:, :2]
    turned = [spline_integral(time_s[part], slope[part]) for part in parts]
    return gravity[:, :2] - np.concatenate(turned), slope


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
    """Returns the share of the level's variance that the rates' errors explain; the integration explains the rest.

    Where an acceleration jumps within an interval h, at any share of it, the spline's integral errs in this interval
    and its neighbours: JUMPS times the mean square of these errors is h^2 times that of the slopes' second differences.
    The share is that of James and Stein's estimator, and not below 0.
    """
    wandered = sum(float(np.square(np.diff(level[part], axis=0)).sum()) for part in parts)
    bent = sum(float(np.square(np.diff(slope[part], n=2, axis=0)).sum()) for part in parts)
    added_up = float(np.median(np.diff(time_s))) ** 2 * bent / JUMPS
    return max(1.0 - added_up / wandered, 0.0) if wandered > 0.0 else 0.0


def _turning(time_s: Array, level: Array, gravity: Array, parts: Sequence[slice]) -> Array:
    """Returns the rates (n, 3) that the level's drift implies and the recorded ones lack.

    A turn about gravity is unseen.
    """
    along = derivative(level, time_s, parts)
    upright = np.copysign(np.maximum(np.abs(gravity[:, 2]), LEAST_UPRIGHT), gravity[:, 2])
    across = -(along * gravity[:, :2]).sum(axis=1) / upright
    return cross(np.column_stack([along, across]), gravity)
