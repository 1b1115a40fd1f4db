"""Builds what a recording has more than a simulation: a model that changes its friction, push and picture.

Both are fitted with the same kinds of effects. Where the recording's friction is h and the simulation's is k, a
simulator whose friction is multiplied by h / k has the recording's; pushes, turns and shifts of the image are added as
the recording's less the simulation's.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from station.physics.contact import Array, Contact, View
from station.physics.effect import Effect, Values
from station.physics.model import Model, Term

LEAST = 1e-6
"""The least factor on friction that another one is divided by: a law may lead to none at all."""


class Between(Effect):
    """The step from an effect as a simulation has it to the same effect as the recording has it.

    Its values are the recording's numbers; at the simulation's it changes nothing.
    """

    def __init__(self, effect: Effect, there: Values) -> None:
        """Takes the effect, and its numbers in the simulation."""
        self._effect, self._there = effect, dict(there)
        for name in ("id", "title", "law", "source", "layer", "family", "parameters", "separated_by"):
            setattr(self, name, getattr(effect, name))

    def acts_through(self) -> frozenset[str]:
        """Returns the methods of the effect itself."""
        return self._effect.acts_through()

    def is_null(self, values: Values) -> bool:
        """Returns true if both have the same numbers, or the effect vanishes in both."""
        nowhere = self._effect.is_null(values) and self._effect.is_null(self._there)
        return nowhere or dict(values) == self._there

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """Returns the ratio (n,) of both factors."""
        there = np.maximum(self._effect.friction(contact, self._there), LEAST)
        return self._effect.friction(contact, values) / there

    def steering(self, contact: Contact, values: Values) -> Array | float:
        """Returns the ratio (n,) of both factors on the curve that steers."""
        there = np.maximum(self._effect.steering(contact, self._there), LEAST)
        return self._effect.steering(contact, values) / there

    def unturned(self, contact: Contact, values: Values) -> Array | float:
        """Returns the ratio (n,) of both factors beside a moment."""
        there = np.maximum(self._effect.unturned(contact, self._there), LEAST)
        return self._effect.unturned(contact, values) / there

    def push(self, contact: Contact, values: Values) -> Array | None:
        """Returns the difference (n, 3) of both pushes, m/s²."""
        return _less(self._effect.push(contact, values), self._effect.push(contact, self._there))

    def spin(self, contact: Contact, values: Values) -> Array | float:
        """Returns the difference (n,), rad/s²."""
        return self._effect.spin(contact, values) - self._effect.spin(contact, self._there)

    def lever(self, contact: Contact, values: Values) -> Array | float:
        """Returns the difference (n,), m."""
        return self._effect.lever(contact, values) - self._effect.lever(contact, self._there)

    def lead(self, contact: Contact, values: Values) -> Array | float:
        """Returns the difference (n,), widths of the sole."""
        return self._effect.lead(contact, values) - self._effect.lead(contact, self._there)

    def attitude(self, contact: Contact, values: Values) -> Array | None:
        """Returns the difference (n, 3) of both rotation vectors, rad."""
        return _less(self._effect.attitude(contact, values), self._effect.attitude(contact, self._there))

    def delay_s(self, values: Values) -> float:
        """Returns the difference, s."""
        return self._effect.delay_s(values) - self._effect.delay_s(self._there)

    def arm_delay_s(self, values: Values) -> float:
        """Returns the difference, s."""
        return self._effect.arm_delay_s(values) - self._effect.arm_delay_s(self._there)

    def creep(self, contact: Contact, values: Values) -> Array | None:
        """Returns the difference (n, 2), m/s."""
        return _less(self._effect.creep(contact, values), self._effect.creep(contact, self._there))

    def seen(self, view: View, values: Values) -> Array | None:
        """Returns the difference (n, 4, 2), m."""
        return _less(self._effect.seen(view, values), self._effect.seen(view, self._there))

    def mass(self, contact: Contact, values: Values) -> Array | None:
        """Returns the difference (n, 3), widths of the sole."""
        return _less(self._effect.mass(contact, values), self._effect.mass(contact, self._there))


def between(recording: Model, simulation: Model) -> Model:
    """Returns the model that turns a simulator with `simulation`'s friction into one with `recording`'s.

    Its mu_s is a factor.

    An effect that one of the two lacks is at its null there.
    """
    mine, theirs = _by_id(recording), _by_id(simulation)
    terms = list[Term]()
    for name in dict.fromkeys([*mine, *theirs]):
        effect = (mine.get(name) or theirs[name]).effect
        values, there = (
            side[name].values if name in side else {**effect.neutral(), **_shapes(effect, other[name].values)}
            for side, other in ((mine, theirs), (theirs, mine))
        )
        terms.append(Term(Between(effect, there), dict(values)))
    return Model(mu_s=recording.mu_s / simulation.mu_s, scatter=recording.scatter, terms=tuple(terms))


def _by_id(model: Model) -> Mapping[str, Term]:
    return {term.effect.id: term for term in model.terms}


def _shapes(effect: Effect, values: Values) -> dict[str, float]:
    """Returns the shapes of the side that has the effect: they mean nothing at the null."""
    return {one.name: values[one.name] for one in effect.parameters if one.is_shape}


def _less(here: Array | None, there: Array | None) -> Array | None:
    if there is None:
        return here
    return -there if here is None else here - there
