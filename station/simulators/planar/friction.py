"""The limit curve as a model gives it: its support function h and the two derivatives by the direction.

An effect that never asks for the direction of sliding leaves the curve round: it is called once, the others three
times, for a central difference.
"""

from __future__ import annotations

from dataclasses import fields
from typing import NamedTuple

import numpy as np

from station.physics.contact import Array, Bools, Contact
from station.physics.model import Model, Term

DELTA_RAD = 1e-4


class Support(NamedTuple):
    """h (a,) and its first and second derivative by the direction."""

    value: Array
    slope: Array | float
    bend: Array | float


class LimitCurve:
    """Friction of a model without its scatter."""

    def __init__(self, model: Model) -> None:
        self._mu = model.mu_s
        terms = model.acting("friction")
        self._round = tuple(term for term in terms if not asks_for_direction(term))
        self._directed = tuple(term for term in terms if asks_for_direction(term))

    @property
    def is_round(self) -> bool:
        """Whether friction is the same in every direction."""
        return not self._directed

    def value(self, contact: Contact | None, factor: Array) -> Array:
        """h (a,) at the contact's direction, times each run's factor (a,)."""
        total = factor * self._mu
        if contact is not None:
            for term in (*self._round, *self._directed):
                total = total * term.effect.friction(contact, term.values)
        return total

    def at(self, contact: Contact | None, factor: Array, *, bends: bool = True) -> Support:
        """h and its derivatives; h″ only if it is wanted (`bends`)."""
        plain = factor * self._mu
        if contact is None:
            return Support(plain, 0.0, 0.0)
        for term in self._round:
            plain = plain * term.effect.friction(contact, term.values)
        if not self._directed:
            return Support(plain, 0.0, 0.0)
        way = contact.way_rad
        before, after = (self._product(facing_to(contact, way + turn)) for turn in (-DELTA_RAD, DELTA_RAD))
        slope = plain * ((after - before) * (0.5 / DELTA_RAD))
        if not bends:
            # The mean of both is h to 5e-9 of h″: one evaluation saved.
            return Support(plain * (0.5 * (after + before)), slope, 0.0)
        here = self._product(contact)
        return Support(plain * here, slope, plain * ((after - 2.0 * here + before) * DELTA_RAD**-2))

    def _product(self, contact: Contact) -> Array | float:
        total = 1.0
        for term in self._directed:
            total = total * term.effect.friction(contact, term.values)
        return total


_NAMES = tuple(spec.name for spec in fields(Contact))


def facing_to(contact: Contact, way_rad: Array) -> Contact:
    """The same contact with another direction of sliding; `dataclasses.replace` takes three times as long."""
    return _altered(contact, "way_rad", way_rad)


def setting_off(contact: Contact) -> Contact:
    """The same blocks at the very beginning of a slide."""
    return _altered(contact, "moving", np.ones(len(contact), dtype=bool))


def _altered(contact: Contact, changed: str, value: Array | Bools) -> Contact:
    other, put = object.__new__(Contact), object.__setattr__
    for name in _NAMES:
        put(other, name, value if name == changed else getattr(contact, name))
    return other


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


def asks_for_direction(term: Term) -> bool:
    """Whether an effect's friction reads the direction of sliding, at rest or in motion."""
    found = False
    for moving in (False, True):
        watched = _Watched(_somewhere(moving=moving))
        term.effect.friction(watched, term.values)
        found = found or watched.asked
    return found


def _somewhere(*, moving: bool) -> Contact:
    """Any contact: two moments of a block on a slope."""
    number, vector = np.array([0.1, 0.2]), np.full((2, 3), 0.1)
    values = {spec.name: number for spec in fields(Contact)}
    values |= {"rate_rad_s": vector, "acceleration_rad_s2": vector, "moving": np.full(2, moving)}
    return Contact(**values)
