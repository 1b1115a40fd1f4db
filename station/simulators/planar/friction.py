"""The limit curve as a model gives it: its support function h and the two derivatives by the direction.

An effect that never asks for the direction of sliding leaves the curve round: it is called once, the others three
times, for a central difference.
"""

from __future__ import annotations

from dataclasses import fields
from functools import cached_property
from typing import NamedTuple

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.model import Model, Term
from station.simulators.planar.asked import Asked

DELTA_RAD = 1e-4


class Support(NamedTuple):
    """h (a,), the force across the way, h (ln s)′, and its derivative; h′ and h″ by maximum dissipation.

    s is the curve that steers, see `station.physics.dissipation`.
    """

    value: Array
    slope: Array | float
    bend: Array | float


class LimitCurve:
    """The friction of a model without its scatter."""

    def __init__(self, model: Model, *, phases: tuple[bool, ...] = (False, True)) -> None:
        """`phases` says if it is to be asked for blocks at rest (False), in motion (True), or both."""
        self._model, self._mu = model, model.mu_s
        terms = model.acting("friction")
        self._directed = tuple(term for term in terms if asks_for_direction(term, phases=phases))
        self._round = tuple(term for term in terms if term not in self._directed)

    @cached_property
    def in_motion(self) -> LimitCurve:
        """The limit curve for sliding blocks only, which may be round."""
        return LimitCurve(self._model, phases=(True,))

    @property
    def is_round(self) -> bool:
        """True if friction is the same in every direction."""
        return not self._directed

    def value(self, contact: Contact | None, factor: Array) -> Array:
        """Returns h (a,) at the contact's direction, times each run's factor (a,)."""
        total = factor * self._mu
        if contact is not None:
            for term in (*self._round, *self._directed):
                total = total * term.effect.friction(contact, term.values)
        return total

    def at(self, contact: Contact | None, factor: Array, *, bends: bool = True) -> Support:
        """Returns h and its derivatives; h″ only if it is wanted (`bends`).

        They are for the contact's direction, and times each run's `factor` (a,), a number without a unit.
        """
        plain = factor * self._mu
        if contact is None:
            return Support(plain, 0.0, 0.0)
        for term in self._round:
            plain = plain * term.effect.friction(contact, term.values)
        if not self._directed:
            return Support(plain, 0.0, 0.0)
        way = contact.way_rad
        before, after = (self._product(contact.facing(way + turn)) for turn in (-DELTA_RAD, DELTA_RAD))
        slope = plain * ((after - before) * (0.5 / DELTA_RAD))
        if not bends and self._model.is_dissipative:
            # The mean of both is h to 5e-9 of h″: one evaluation saved.
            return Support(plain * (0.5 * (after + before)), slope, 0.0)
        here = self._product(contact)
        bend = plain * ((after - 2.0 * here + before) * DELTA_RAD**-2)
        if self._model.is_dissipative:
            return Support(plain * here, slope, bend)
        more = [self._more(contact.facing(way + turn)) for turn in (-DELTA_RAD, 0.0, DELTA_RAD)]
        turning = (more[2] - more[0]) * (0.5 / DELTA_RAD)
        return Support(plain * here * more[1], slope * more[1], bend * more[1] + slope * turning)

    def _product(self, contact: Contact) -> Array | float:
        """Returns the curve that steers, without what is round."""
        total = 1.0
        for term in self._directed:
            total = total * term.effect.steering(contact, term.values)
        return total

    def _more(self, contact: Contact) -> Array | float:
        """Returns the ratio of the friction to the curve that steers."""
        total = 1.0
        for term in self._directed:
            friction = term.effect.friction(contact, term.values)
            total = total * friction / term.effect.steering(contact, term.values)
        return total


def setting_off(contact: Contact) -> Contact:
    """Returns the same blocks at the very beginning of a slide."""
    return Asked.like(contact, moving=np.ones(len(contact), dtype=bool))


class _Watched(Contact):
    """A contact that notices when it is asked for the direction of sliding."""

    def __init__(self, contact: Contact) -> None:
        self.asked = False
        for spec in fields(Contact):
            object.__setattr__(self, spec.name, getattr(contact, spec.name))

    def __getattribute__(self, name: str) -> object:
        if name == "way_rad":
            object.__setattr__(self, "asked", True)
        return object.__getattribute__(self, name)

    def __setattr__(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)


def asks_for_direction(term: Term, *, phases: tuple[bool, ...] = (False, True)) -> bool:
    """Returns true if an effect's friction depends on the direction of sliding, at rest (False) or in motion (True).

    One that only looks at it says the same in all directions.
    """
    for moving in phases:
        watched = _Watched(_somewhere(moving=moving))
        said = np.broadcast_to(term.effect.friction(watched, term.values), len(_WAYS_RAD))
        if watched.asked and np.ptp(said) != 0.0:
            return True
    return False


_WAYS_RAD = np.array([0.1, 0.2, 1.3, 2.9, 4.4])


def _somewhere(*, moving: bool) -> Contact:
    """Makes up a contact: a block on a slope that slides in several directions."""
    count = len(_WAYS_RAD)
    values = {spec.name: np.full(count, 0.1) for spec in fields(Contact)}
    vector = np.full((count, 3), 0.1)
    values |= {"way_rad": _WAYS_RAD, "rate_rad_s": vector, "acceleration_rad_s2": vector}
    return Contact(**values | {"moving": np.full(count, moving)})
