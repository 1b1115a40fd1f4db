"""The likelihood of the blocks' first millimetres under the laws of sliding friction that models have.

The windows of the slides measure friction by speed; the way a block gathers its speed from rest distinguishes laws that
look alike there: a sudden drop, a gentle fall, one by the logarithm of the speed. For models that differ in nothing
else this compares the whole paths (`breakaway`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares

from station.diagnosis.observations.breakaway import Breakaways, Law
from station.diagnosis.observations.breakaway_search import Effort, Sloped, climbed
from station.diagnosis.observations.breakaway_tables import COUNT, SPEEDS_M_S, Along, Laws, cubics
from station.physics.contact import GRAVITY_M_S2, Array, Bools, Contact
from station.physics.model import Model, Term
from station.physics.parameter import Parameter

MOST_RUNS = 60
TRIED, SEARCH = 13, Effort(20, 0.02)
SOFTENED = (5.0, 1.0)
"""The factors on the noise along the way: far from the maximum no path is likelier than another."""
EPS = 1e-4
"""The step, in a number's typical size, by which the tables of laws are differentiated."""

SEEN_M_S, SEARCHES = 0.25, 40
"""The highest speed, m/s, of a block in its first millimetres, and the evaluations of a comparison of laws."""

SLIDE_M_S2 = 1.0
"""A block's typical acceleration: a law that changes with the time since the slip is tabulated accordingly."""

CHANGES, CHANGES_M_S2 = 3e-4, 2e-3
"""No paths show a law that changes friction, relatively, or the blocks' acceleration by less (rms of the runs)."""

SPREADS, CREEPS_M = (1e-4, 0.3), (1e-6, 1e-2)
LEAST_SPEED = 1e-9


@dataclass(frozen=True, eq=False)
class Paths:
    """Blocks' first paths; `contact` (r,) are their states at the slip, and `law` is the likeliest law of them all."""

    breakaways: Breakaways
    contact: Contact
    law: Law

    @classmethod
    def of(cls, breakaways: Breakaways, contact: Contact, law: Law) -> Paths:
        """Builds it from all runs (r,), with the paths of at most MOST_RUNS, evenly spaced."""
        some = np.unique(np.linspace(0, len(contact) - 1, MOST_RUNS).astype(int))
        return cls(breakaways.some(MOST_RUNS), contact.chosen(some), law)

    @cached_property
    def _speeds(self) -> _Speeds:
        return _Speeds.of(self.contact)

    def of_runs(self, number: Array) -> Paths | None:
        """Returns the paths of the runs with the numbers `number` (m,), as `contact` has them; None without any."""
        indices = np.flatnonzero(np.isin(self.contact.run, number))
        if not len(indices):
            return None
        return replace(self, breakaways=self.breakaways.chosen(indices), contact=self.contact.chosen(indices))

    def sliding_terms(self, model: Model) -> tuple[Term, ...]:
        """Returns the terms of a model whose laws of sliding change these paths."""
        return tuple(term for term in model.terms if self._changes(term))

    def _changes(self, term: Term) -> bool:
        held, slowing = self._speeds.tables((term,))
        return bool(_rms(held - 1.0).max() > CHANGES or _rms(slowing).max() > CHANGES_M_S2)

    def nearest(self, start: Sequence[Term]) -> tuple[tuple[Term, ...], float]:
        """Gives the terms' values nearest to the likeliest law of all paths, and the remaining difference (rms), m/s².

        The search begins at the values that the terms have.
        """
        typical = self.contact.chosen(np.array([int(np.argsort(self.contact.tilt_rad)[len(self.contact) // 2])]))
        held_m_s2, speeds = GRAVITY_M_S2 * math.sin(float(typical.tilt_rad[0])), _Speeds.of(typical)
        seen, law = SPEEDS_M_S < SEEN_M_S, self.law.of_runs(1)
        wanted = (held_m_s2 * law.held[0, :, 0] + law.slowing_m_s2[0, :, 0])[seen[:-1]]
        numbers = _numbers(start)

        def off(inner: Array) -> Array:
            held, slowing = speeds.tables(_valued(start, numbers, inner))
            return (held_m_s2 * held + slowing)[0, seen] - wanted

        begin, (low, high) = _inner(start, numbers), np.array(_bounds(numbers)).T
        found = least_squares(off, np.clip(begin, low + EPS, high - EPS), bounds=(low, high), max_nfev=SEARCHES)
        return _valued(start, numbers, np.asarray(found.x)), math.sqrt(float(np.mean(np.square(found.fun))))

    def log_likelihood(self, terms: Sequence[Term]) -> float:
        """Returns the paths' log likelihood, maximised over the terms' values.

        The windows determine little of two laws that nearly cancel there, so the search then also begins where the two
        together come nearest to the likeliest law of all paths.
        """
        starts = [tuple(terms), self.nearest(terms)[0]] if len(terms) > 1 else [tuple(terms)]
        return max(self._climbed(start) for start in starts)

    def _climbed(self, terms: tuple[Term, ...]) -> float:
        numbers = _numbers(terms)
        found = _Sliding(self._speeds, terms, self.law.drop_spread, max(self.law.creep_m, 2e-6))
        for times in SOFTENED:
            soft = self.breakaways.softened(times)
            near = soft.around(found, TRIED)
            found = self._fitted(near, found, numbers)
        return self.breakaways.around(found, TRIED).log_likelihood(found)

    def _fitted(self, near: Breakaways, start: _Sliding, numbers: Sequence[_Number]) -> _Sliding:
        def law_of(inner: Array) -> _Sliding:
            spread, creep_m = np.exp(inner[:2]).tolist()
            return _Sliding(self._speeds, _valued(start.terms, numbers, inner[2:]), spread, creep_m)

        order = np.roll(np.arange(len(numbers) + 2), 2)

        def at(inner: Array) -> Sloped:
            along = _along(start.terms, numbers, inner[2:], self._speeds)
            return near.sloped(law_of(inner), along).of(order, np.ones(len(inner)))

        shown = np.log([max(start.spread, 1e-3), start.creep_m])
        begin = np.concatenate([shown, _inner(start.terms, numbers)])
        bounds = [(math.log(low), math.log(high)) for low, high in (SPREADS, CREEPS_M)]
        inner, _ = climbed(at, begin, np.array([*bounds, *_bounds(numbers)]), SEARCH)
        return law_of(inner)


def _rms(tables: Array) -> Array:
    """Returns the rms over the runs (COUNT,) of tables (r, COUNT)."""
    return np.sqrt(np.mean(np.square(tables), axis=0))


_Number = tuple[int, Parameter]
"""A term's index among the terms, and one of its parameters."""


def _numbers(terms: Sequence[Term]) -> list[_Number]:
    return [(index, parameter) for index, term in enumerate(terms) for parameter in term.effect.parameters]


def _inner(terms: Sequence[Term], numbers: Sequence[_Number]) -> Array:
    """Returns the numbers (k,) in their typical sizes."""
    return np.array([terms[index].values[parameter.name] / parameter.typical for index, parameter in numbers])


def _bounds(numbers: Sequence[_Number]) -> list[tuple[float, float]]:
    return [(parameter.low / parameter.typical, parameter.high / parameter.typical) for _, parameter in numbers]


def _valued(terms: Sequence[Term], numbers: Sequence[_Number], inner: Array) -> tuple[Term, ...]:
    """Returns the terms with the numbers `inner` (k,), given in typical sizes."""
    changed: list[dict[str, float]] = [{} for _ in terms]
    for (index, parameter), value in zip(numbers, inner.tolist(), strict=True):
        changed[index][parameter.name] = parameter.clipped(value * parameter.typical)
    return tuple(term.with_values(**values) for term, values in zip(terms, changed, strict=True))


@dataclass(frozen=True, eq=False)
class _Sliding:
    """The laws by which the runs slide under these terms; see `breakaway.Falling`."""

    speeds: _Speeds
    terms: tuple[Term, ...]
    spread: float
    creep_m: float

    def of_runs(self, runs: int) -> Laws:
        held, slowing = self.speeds.tables(self.terms)
        return Laws(cubics(held), cubics(slowing), np.arange(runs, dtype=np.int64), self.spread, self.creep_m)


def _along(terms: Sequence[Term], numbers: Sequence[_Number], inner: Array, speeds: _Speeds) -> Along:
    """Returns the slopes of each run's tables by the numbers `inner` (k,), by central differences within the bounds."""
    low, high = np.array(_bounds(numbers)).reshape(-1, 2).T

    def tables(inner: Array) -> Array:
        return np.array(speeds.tables(_valued(terms, numbers, inner)))

    slopes = np.empty((2, len(inner), len(speeds.still), COUNT))
    for index, step in enumerate(EPS * np.eye(len(inner))):
        above, below = np.minimum(inner + step, high), np.maximum(inner - step, low)
        slopes[:, index] = (tables(above) - tables(below)) / (above - below)[index]
    return Along(*cubics(slopes))


@dataclass(frozen=True, eq=False)
class _Speeds:
    """Runs (r,) at rest, `still`, and each of them at every one of SPEEDS_M_S: `resting` and `sliding` (r COUNT,)."""

    still: Contact
    resting: Contact
    sliding: Contact

    @classmethod
    def of(cls, still: Contact) -> _Speeds:
        runs = len(still)
        resting, speed = still.chosen(np.repeat(np.arange(runs), COUNT)), np.tile(SPEEDS_M_S, runs)
        moving: Bools = np.ones(len(speed), dtype=np.bool_)
        fast = np.maximum(speed, LEAST_SPEED)
        return cls(still, resting, replace(resting, moving=moving, speed_m_s=fast, slid_s=speed / SLIDE_M_S2))

    def tables(self, terms: Sequence[Term]) -> tuple[Array, Array]:
        """Returns the ratio of sliding to static friction, and other deceleration, m/s², of each run by speed.

        Both are (r, COUNT).
        """
        model, runs = Model(mu_s=1.0, terms=tuple(terms)), len(self.still)
        held = model.friction(self.sliding).reshape(runs, COUNT) / model.friction(self.still)[:, None]
        pushed = (model.push(self.sliding) - model.push(self.resting))[:, :2].reshape(runs, COUNT, 2)
        way = self.still.way[:, None, :]
        return held, -(pushed[..., 0] * way[..., 0] + pushed[..., 1] * way[..., 1])
