"""The likeliest law of a session's breakaways: a sudden drop of friction, a gentle fall, or both, with a drag."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from station.diagnosis.observations.breakaway import ALONG, LOGARITHM, SHAPES, Breakaways, Law
from station.diagnosis.observations.breakaway_search import Effort, Sloped, climbed
from station.physics.contact import Array

FEW, MANY = 30, 120
"""The numbers of runs that select the kind of law, and that it is then fitted to."""

TRIED = 13

BRIEF, THOROUGH = Effort(10, 0.01), Effort(100, 0.001)
"""The searches on the way, and the last one. Where a fall and a drag nearly cancel, the likelihood rises along a narrow
ridge by steps of about 0.01: a search that ended there was up to 8 short, and the processor's rounding decided where
it ended (`pytest tests/unit/diagnosis/test_slips.py -k "makes up"`)."""

FOLLOWED = 10
"""A search begins anew where it ended at most so often. Its moments of slip belong to where it began: without this it
ended up to 7 short of the planted law, and on each processor elsewhere (`pytest tests/unit/diagnosis/test_slips.py -k
gentle`)."""

STARTS_M_S = (0.005, 0.03)
"""The speeds of gentle falls at which their search starts."""

BESIDE = {"fall_speed_m_s": 0.005, "shape": LOGARITHM}
"""The start of the search for a gentle law that a sudden drop hides."""

SOFTENED, NARROW, ROUGHLY = (20.0, 6.0, 1.5, 1.0), 5.0, 1.5
"""The factors on the noise along the way from a distant start; above NARROW all moments are tried, and ROUGHLY is the
factor of rough fits."""

GAIN, NEARLY = 5.0, 15.0
"""The log likelihood that one more number has to gain, and how far behind a law may be to be tried further."""


@dataclass(frozen=True, slots=True)
class _Number:
    """A number of a law with its bounds and its scale; a scale of 0 means that its logarithm is sought."""

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
SPREAD, CREEP = "drop_spread", "creep_m"
COMMON = (SPREAD, "drag_per_s")
SUDDEN, GENTLE = ("drop", *COMMON), ("fall", "fall_speed_m_s", *COMMON)


def session_law(paths: Breakaways, *, drag_per_s: float) -> Law:
    """Returns the likeliest law of a session's slides, penalised by GAIN for each number.

    `drag_per_s` is the first look's.

    The search starts near that drag: far from it no path is likelier than another.
    """
    few = paths.some(FEW)
    far = Law(drop=0.01, drop_spread=0.01, drag_per_s=drag_per_s, creep_m=1e-4)
    sudden = _led(few, far, (*SUDDEN, CREEP))
    none = replace(sudden.law, drop=0.0, fall_speed_m_s=0.02)
    plain = _led(few, none, COMMON, SOFTENED[2:])
    gentle = [_gentle(few, none, sudden.law.drop, shape) for shape in SHAPES]
    found = [plain, replace(sudden, free=SUDDEN), *gentle]
    if _worth(sudden) > _worth(plain):
        found.append(
            _with_drop(few, [replace(none, **BESIDE, drop=sudden.law.drop, fall=fall) for fall in (-0.01, 0.01)])
        )
    if max(map(_worth, gentle)) > max(map(_worth, found[:2])) - NEARLY:
        both = [each for each in gentle if _worth(each) > max(map(_worth, gentle)) - NEARLY]
        found += [_with_drop(few, _dropping(each.law, sudden.law.drop)) for each in both]
    return _chosen_by_many(paths.some(MANY), found).law


def _gentle(paths: Breakaways, none: Law, drop: float, shape: int) -> _Found:
    """Returns the likeliest fall or rise of a shape, from the best of several starts."""
    falls = (0.3 * drop + 0.01, -0.01) if shape == LOGARITHM else (drop + 0.02, -0.02)
    starts = [replace(none, fall=fall, fall_speed_m_s=speed, shape=shape) for fall in falls for speed in STARTS_M_S]
    tried = [_fitted(_near(paths, start, ROUGHLY), start, GENTLE, BRIEF) for start in starts]
    return _fitted_near(paths, max(tried, key=_worth).law, GENTLE, BRIEF)


def _dropping(law: Law, drop: float) -> list[Law]:
    """Starts with a small drop beside a gentle fall, and with about the whole drop and half the fall."""
    return [replace(law, drop=0.2 * abs(law.fall)), replace(law, drop=max(drop, 0.01), fall=0.5 * law.fall)]


def _with_drop(paths: Breakaways, starts: Sequence[Law]) -> _Found:
    """Returns the likeliest law with a drop beside a gentle fall, from the best of several starts."""
    free = (*GENTLE, "drop")
    tried = [_fitted(_near(paths, start, ROUGHLY), start, free, BRIEF) for start in starts]
    return _fitted_near(paths, max(tried, key=_worth).law, free, BRIEF)


def _near(paths: Breakaways, law: Law, times: float = 1.0) -> Breakaways:
    return paths.softened(times).around(law, TRIED)


def _fitted_near(paths: Breakaways, law: Law, free: Sequence[str], effort: Effort) -> _Found:
    """Returns the likeliest law near another; the moments that are tried follow it until it no longer moves."""
    found = _fitted(_near(paths, law), law, free, effort)
    for _ in range(FOLLOWED):
        near = _near(paths, found.law)
        begun, found = near.log_likelihood(found.law), _fitted(near, found.law, free, effort)
        if found.value < begun + effort.least:
            break
    return found


def _chosen_by_many(paths: Breakaways, found: Sequence[_Found]) -> _Found:
    """Returns the law that MANY runs prefer after a brief search, of those that a FEW runs find about as likely as any.

    Laws that remain close to each other put the slips at the same moments: one that was 36 less likely moved 382 slips
    by 0.05 of their standard errors on average.
    """
    least = max(map(_worth, found)) - NEARLY
    likely = [each for each in found if _worth(each) > least]
    tried = [_fitted(_near(paths, each.law), each.law, (*each.free, CREEP), BRIEF) for each in likely]
    best = max(tried, key=_worth)
    return _fitted_near(paths, best.law, best.free, THOROUGH)


def _worth(found: _Found) -> float:
    """Returns the log likelihood less the penalty for the law's numbers."""
    return found.value - GAIN * len(found.free)


@dataclass(frozen=True, slots=True)
class _Found:
    law: Law
    value: float
    free: Sequence[str]


def _led(paths: Breakaways, start: Law, free: Sequence[str], softened: Sequence[float] = SOFTENED) -> _Found:
    """Returns the likeliest law that differs from `start` in the `free` numbers, sought from afar."""
    found = _Found(start, -math.inf, free)
    for times in softened:
        near = paths.softened(times) if times > NARROW else _near(paths, found.law, times)
        found = _fitted(near, found.law, free, THOROUGH if times == softened[-1] else BRIEF)
    return found


def _fitted(paths: Breakaways, start: Law, free: Sequence[str], effort: Effort) -> _Found:
    numbers = [NUMBERS[name] for name in free]
    bent = [name for name in free if name in ALONG]
    indices = np.array([[*bent, SPREAD, CREEP].index(name) for name in free])
    units = np.array([number.scale or 1.0 for number in numbers])

    def law_of(inner: Array) -> Law:
        values = [number.outer(value) for number, value in zip(numbers, inner.tolist(), strict=True)]
        return replace(start, **dict(zip(free, values, strict=True)))

    def at(inner: Array) -> Sloped:
        law = law_of(inner)
        return paths.sloped(law, law.along(bent)).of(indices, units)

    begin = np.array([number.inner(getattr(start, name)) for name, number in zip(free, numbers, strict=True)])
    bounds = np.array([(number.inner(number.low), number.inner(number.high)) for number in numbers])
    inner, value = climbed(at, begin, bounds, effort)
    return _Found(law_of(inner), value, free)
