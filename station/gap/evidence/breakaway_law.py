"""The likeliest law of a session's breakaways: a sudden fall of friction, a gentle one, or both, with a drag."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from station.gap.evidence.breakaway import COUNT, LOGARITHM, LORENTZIAN, Breakaways, Law
from station.physics.contact import Array

FEW, MANY = 30, 120
"""Runs that the kind of law is sought with, and those that it is then fitted to."""

TRIED = 13
SHORTEST, LONGEST = 10, 25
"""Steps of a search on the way and at its end."""

NEAR_ENOUGH = 0.01
"""Of the ln of the likelihood: a step that brings less ends a search."""

SOFTENED, NARROW = (20.0, 6.0, 1.5, 1.0), 5.0
"""How much noise is taken on the way from afar, and above how much the moments are all looked at."""

GAIN, NEARLY = 5.0, 15.0
"""What one more number has to bring, ln of the likelihood, and how far behind a law may be to be tried on."""


@dataclass(frozen=True, slots=True)
class _Number:
    """A number of a law: its bounds, and its scale, or 0 where it is sought by its logarithm."""

    low: float
    high: float
    scale: float = 0.0

    def inner(self, value: float) -> float:
        return value / self.scale if self.scale else math.log(value)

    def outer(self, value: float) -> float:
        return value * self.scale if self.scale else math.exp(value)


NUMBERS = {
    "drop": _Number(0.0, 0.6, 0.01),
    "drop_spread": _Number(1e-4, 0.3),
    "fall": _Number(-0.3, 0.6, 0.01),
    "fall_speed_m_s": _Number(2e-3, 0.2),
    "drag_per_s": _Number(-5.0, 30.0, 1.0),
    "creep_m": _Number(1e-6, 1e-2),
}
COMMON = ("drop_spread", "drag_per_s")
SUDDEN, GENTLE = ("drop", *COMMON), ("fall", "fall_speed_m_s", *COMMON)
CREEP = "creep_m"


def session_law(paths: Breakaways, *, drag_per_s: float) -> Law:
    """The likeliest law of a session's slides; one with more numbers only if they are worth it.

    It is sought from about the drag that a first look shows: far from it no path would be any likelier than another.
    """
    few = paths.some(FEW)
    far = Law(drop=0.01, drop_spread=0.01, drag_per_s=drag_per_s, creep_m=1e-4)
    sudden = _led(few, far, (*SUDDEN, CREEP))
    none = replace(sudden.law, drop=0.0, fall_speed_m_s=0.02)
    falls = (sudden.law.drop + 0.02, -0.02)
    gentle = max((_led(few, replace(none, fall=fall), GENTLE, SOFTENED[1:]) for fall in falls), key=_worth)
    found = [_led(few, none, COMMON, SOFTENED[2:]), replace(sudden, free=SUDDEN), gentle]
    if _worth(gentle) > max(map(_worth, found[:2])):
        law = gentle.law
        slow = replace(law, shape=LOGARITHM, fall=0.3 * law.fall, fall_speed_m_s=0.3 * law.fall_speed_m_s)
        found += [_led(few, start, GENTLE, SOFTENED[2:]) for start in (replace(law, shape=LORENTZIAN), slow)]
        both = replace(max(found[2:], key=_worth).law, drop=0.2 * abs(gentle.law.fall))
        found.append(_led(few, both, (*GENTLE, "drop"), SOFTENED[2:]))
    return _among(paths.some(MANY), found).law


def _among(paths: Breakaways, found: Sequence[_Found]) -> _Found:
    """The one that many runs speak for, of those for which a few speak about as much as for any."""
    least = max(map(_worth, found)) - NEARLY
    fitted = [
        _fitted(paths.nearer(each.law, COUNT).nearer(each.law, TRIED), each.law, (*each.free, CREEP), LONGEST)
        for each in found
        if _worth(each) > least
    ]
    return max(fitted, key=_worth)


def _worth(found: _Found) -> float:
    """ln of the likelihood, less what its numbers have to bring."""
    return found.value - GAIN * len(found.free)


@dataclass(frozen=True, slots=True)
class _Found:
    law: Law
    value: float
    free: Sequence[str]


def _led(paths: Breakaways, start: Law, free: Sequence[str], softened: Sequence[float] = SOFTENED) -> _Found:
    """The likeliest law that differs from `start` in what is free, from afar."""
    found = _Found(start, -math.inf, free)
    for times in softened:
        soft = paths.softened(times)
        near = soft if times > NARROW else soft.nearer(found.law, COUNT).nearer(found.law, TRIED)
        found = _fitted(near, found.law, free, LONGEST if times == softened[-1] else SHORTEST)
    return found


def _fitted(paths: Breakaways, start: Law, free: Sequence[str], steps: int) -> _Found:
    numbers = [NUMBERS[name] for name in free]

    def law_of(inner: Array) -> Law:
        values = [number.outer(value) for number, value in zip(numbers, inner.tolist(), strict=True)]
        return replace(start, **dict(zip(free, values, strict=True)))

    def cost(inner: Array) -> float:
        return -paths.log_likelihood(law_of(inner))

    begin = np.array([number.inner(getattr(start, name)) for name, number in zip(free, numbers, strict=True)])
    done = minimize(
        cost,
        begin,
        method="L-BFGS-B",
        bounds=[(number.inner(number.low), number.inner(number.high)) for number in numbers],
        options={"maxiter": steps, "eps": 1e-5, "ftol": NEAR_ENOUGH / max(abs(cost(begin)), 1.0)},
    )
    return _Found(law_of(done.x), -float(done.fun), free)
