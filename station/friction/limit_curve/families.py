"""Chooses the family of the run-to-run multiplier of friction, and tests if it fits."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize

from station.friction.direction import Array
from station.friction.limit_curve.curve import Goodness
from station.friction.limit_curve.multiplier import FAMILIES, Family, Multiplier
from station.friction.slides import Bools

BOOTSTRAPS = 99
_MOST_DOF = 100.0
_LEAST_DOF = 2.0
_SURE = 1e-12


@dataclass(frozen=True, eq=False)
class Multipliers:
    """Each run's friction over the curve's (n,): `value`, or NaN and between `above` and `below`."""

    value: Array
    above: Array
    below: Array

    @property
    def known(self) -> Bools:
        """Runs with a value (n,)."""
        return np.isfinite(self.value)


def fit_family(family: Family, runs: Multipliers, *, start: Multiplier | None = None) -> tuple[Multiplier, float]:
    """Returns the family's member of the highest likelihood, and ln of that."""
    known = runs.known
    if start is None:
        start = _start(family, np.log(runs.value[known]))
    elif family == "lognormal" and known.all():
        start = _start(family, np.log(runs.value))
    origin = np.log(np.array(start.parameters))

    def uphill(shift: Array) -> float:
        return -_log_likelihood(_member(family, origin + shift), runs)

    if family == "lognormal" and known.all():
        return start, -uphill(np.zeros(2))
    found: Any = minimize(uphill, np.zeros(len(origin)), method="BFGS", options={"gtol": 1e-3 * math.sqrt(len(known))})
    return _member(family, origin + found.x), -float(found.fun)


def _member(family: Family, logs: Array) -> Multiplier:
    parameters = np.exp(np.clip(logs, -30.0, 30.0)).tolist()
    if family == "log_t":
        parameters[2] = min(max(parameters[2], _LEAST_DOF), _MOST_DOF)
    return Multiplier(family, tuple(parameters))


def _start(family: Family, logs: Array) -> Multiplier:
    middle, spread = float(logs.mean()), max(float(logs.std()), 1e-6)
    if family == "lognormal":
        return Multiplier(family, (math.exp(middle), spread))
    if family == "gamma":
        return Multiplier(family, (1 / spread**2, math.exp(middle) * spread**2))
    if family == "weibull":
        shape = math.pi / (math.sqrt(6) * spread)
        return Multiplier(family, (shape, math.exp(middle + 0.5772 / shape)))
    return Multiplier(family, (math.exp(float(np.median(logs))), 0.8 * spread, 6.0))


def _log_likelihood(member: Multiplier, runs: Multipliers) -> float:
    known = runs.known
    total = float(member.log_density(runs.value[known]).sum())
    if known.all():
        return total
    chance = member.between(runs.above[~known], runs.below[~known])
    return total + float(np.log(np.maximum(chance, 1e-300)).sum())


def choose_family(
    runs: Multipliers, *, rng: np.random.Generator, bootstraps: int = BOOTSTRAPS
) -> tuple[Multiplier, Goodness]:
    """Returns the family of the least AIC, and its goodness of fit: Anderson and Darling's A² by parametric bootstrap.

    Runs known only to lie in an interval get a value drawn from there, in the data as in every bootstrap.
    """
    fits = {family: fit_family(family, runs) for family in FAMILIES}
    aic = {family: 2 * len(member.parameters) - 2 * log for family, (member, log) in fits.items()}
    best = min(FAMILIES, key=lambda family: aic[family])
    member = fits[best][0]
    statistic = _a2(member, runs, rng)
    beaten = 0
    for _ in range(bootstraps):
        again = _replayed(member, runs, rng)
        beaten += _a2(fit_family(best, again, start=member)[0], again, rng) >= statistic
    goodness = Goodness(
        statistic=statistic,
        p_value=(1 + beaten) / (1 + bootstraps),
        bootstraps=bootstraps,
        aic={family: value - aic[best] for family, value in aic.items()},
    )
    return member, goodness


def _replayed(member: Multiplier, runs: Multipliers, rng: np.random.Generator) -> Multipliers:
    """Returns the runs anew with this multiplier: what exceeds a censored run's limit is censored there, and so on."""
    drawn, unknown = member.draw(rng, len(runs.value)), ~runs.known
    below, above = np.where(unknown, runs.below, np.nan), np.where(unknown, runs.above, np.nan)
    open_above, open_below = np.isposinf(below), above <= 0
    hidden = unknown & np.where(open_above, drawn > above, np.where(open_below, drawn <= below, True))
    # An interval between two tilts is a step as wide as before, in which the draw lies anywhere.
    closed = unknown & ~open_above & ~open_below
    width = np.divide(below, above, out=np.ones_like(drawn), where=closed)
    first = drawn * width ** -rng.random(len(drawn))
    low, high = np.where(closed, first, above), np.where(closed, first * width, below)
    return Multipliers(
        value=np.where(hidden, np.nan, drawn), above=np.where(hidden, low, np.nan), below=np.where(hidden, high, np.nan)
    )


def _a2(member: Multiplier, runs: Multipliers, rng: np.random.Generator) -> float:
    """Returns Anderson and Darling's statistic (1952)."""
    known = runs.known
    p = np.empty(len(known))
    p[known] = member.below(runs.value[known])
    low, high = member.below(runs.above[~known]), member.below(runs.below[~known])
    p[~known] = low + rng.random(int((~known).sum())) * (high - low)
    p = np.clip(np.sort(p), _SURE, 1 - _SURE)
    rank = np.arange(1, len(p) + 1)
    return float(-len(p) - ((2 * rank - 1) * (np.log(p) + np.log1p(-p[::-1]))).mean())
