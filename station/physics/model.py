"""A model: one friction coefficient with its scatter, and any number of effects with their values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from shared.errors import UserError
from station.physics.catalogue import Catalogue
from station.physics.checked import a_table, number, only
from station.physics.contact import Array, Contact, View
from station.physics.effect import HOOKS, Effect, Values
from station.physics.smooth import Unnamed
from station.physics.smooth_table import smooth_of_tables, table_of_smooth

EXPOSED_ROUNDS = 4
"""The error of a row's time falls each round to the share of it in which the mark passes a row: .04 at 0.2 m/s, 20 ms
and 100 mm, and .16 at the ends of the parameter."""


@dataclass(frozen=True, slots=True)
class Term:
    """An effect with values for its parameters."""

    effect: Effect
    values: Values

    def with_values(self, **values: float) -> Term:
        """Returns the same effect with some values changed."""
        return Term(self.effect, {**self.values, **values})


@dataclass(frozen=True, kw_only=True)
class Model:
    """Friction `mu_s` (kinetic and static alike) with a relative run-to-run `scatter`, changed by `terms`."""

    mu_s: float
    scatter: float = 0.0
    terms: tuple[Term, ...] = field(default=())

    def acting(self, hook: str) -> tuple[Term, ...]:
        """Returns the terms that act through a method of `Effect` and are not at their null."""
        return self._acting[hook]

    @cached_property
    def _acting(self) -> Mapping[str, tuple[Term, ...]]:
        """The acting terms by hook, cached: channels ask for them some hundred thousand times a diagnosis."""
        found: dict[str, tuple[Term, ...]] = dict.fromkeys(HOOKS, ())
        for term in self.terms:
            if not term.effect.is_null(term.values):
                found |= {hook: (*found[hook], term) for hook in term.effect.acts_through()}
        return found

    @property
    def turns(self) -> bool:
        """True if something turns the block."""
        return bool(self.acting("spin") or self.acting("lever"))

    def friction(self, contact: Contact) -> Array:
        """Returns the limit curve's support function h (n,) at `way_rad`, before the scatter."""
        total = np.full(len(contact), float(self.mu_s))
        for term in self.acting("friction"):
            total *= term.effect.friction(contact, term.values)
        return total

    @cached_property
    def is_dissipative(self) -> bool:
        """True if friction acts by the principle of maximum dissipation: the curve that steers is the limit curve."""
        return all(type(term.effect).steering is Effect.steering for term in self.acting("friction"))

    def steering(self, contact: Contact) -> Array:
        """Returns the curve (n,) whose slope turns a slide, see `Effect.steering`."""
        total = np.full(len(contact), float(self.mu_s))
        for term in self.acting("friction"):
            total *= term.effect.steering(contact, term.values)
        return total

    def push(self, contact: Contact) -> Array:
        """Returns the sum of the pushes (n, 3), m/s²."""
        return _sum((term.effect.push(contact, term.values) for term in self.acting("push")), (len(contact), 3))

    def spin(self, contact: Contact) -> Array:
        """Returns the sum of the angular accelerations (n,), rad/s²."""
        return _sum((term.effect.spin(contact, term.values) for term in self.acting("spin")), (len(contact),))

    def lever(self, contact: Contact) -> Array:
        """Returns the sum of the arms (n,), m, with which friction turns the block."""
        return _sum((term.effect.lever(contact, term.values) for term in self.acting("lever")), (len(contact),))

    def moment(self, contact: Contact, along: Array, across: Array | float = 0.0) -> Array:
        """Returns the moment per mass (n,), m²/s², of a friction that acts beside the mass, as `lever` says.

        Friction that differs by the direction pulls a block across, and turns it with the other part of the arm.

        Args:
            contact: the blocks.
            along: (n,) friction per mass against the way, m/s².
            across: (n,) friction per mass to the right of the way, m/s².
        """
        total = along * self.lever(contact)
        if self.acting("lever") and np.any(across):
            total = total + across * self.lever(contact.facing(contact.way_rad + np.pi / 2))
        return total

    def lead(self, contact: Contact) -> Array:
        """Returns the pressure's lead (n,), widths of the sole, see `station.physics.sole`."""
        return _sum((term.effect.lead(contact, term.values) for term in self.acting("lead")), (len(contact),))

    def attitude(self, contact: Contact) -> Array:
        """Returns the sum of the rotation vectors (n, 3), rad."""
        turns = (term.effect.attitude(contact, term.values) for term in self.acting("attitude"))
        return _sum(turns, (len(contact), 3))

    def motion(self, contact: Contact) -> tuple[Array, Array]:
        """Returns the plate's own rate, rad/s, and acceleration, rad/s² (n, 3) each."""
        moved = _sum((term.effect.motion(contact, term.values) for term in self.acting("motion")), (len(contact), 2, 3))
        return contact.rate_rad_s + moved[:, 0], contact.acceleration_rad_s2 + moved[:, 1]

    def creep(self, contact: Contact) -> Array:
        """Returns the sum of the velocities below the onset (n, 2), m/s."""
        creeping = self.acting("creep")
        if creeping and np.any(np.isnan(contact.spare_m_s2)):
            own = np.isnan(contact.spare_m_s2)
            contact = replace(contact, spare_m_s2=np.where(own, self._spare_m_s2(contact), contact.spare_m_s2))
        return _sum((term.effect.creep(contact, term.values) for term in creeping), (len(contact), 2))

    def _spare_m_s2(self, contact: Contact) -> Array:
        """Returns the reserve (n,), m/s², of the model's friction beyond gravity and pushes, on a plate at rest."""
        push = self.push(contact)
        pull = contact.pulling_m_s2 + contact.down[:, 0] * push[:, 0] + contact.down[:, 1] * push[:, 1]
        return self.friction(contact) * (contact.pressing_m_s2 - push[:, 2]) - pull

    def seen(self, view: View) -> Array:
        """Returns the apparent displacements (n, 4, 2), m.

        They add up, but for what is exposed row by row: a corner has gone on until the row is read in which it is then
        seen, by a lens, say, that shows it elsewhere.
        """
        timed = [term for term in self.acting("seen") if term.effect.exposed_s(view, term.values) is not None]
        placed = [term for term in self.acting("seen") if term not in timed]
        if not timed:
            return _displaced(placed, view)
        shown = view
        for _ in range(EXPOSED_ROUNDS):
            each = (term.effect.exposed_s(shown, term.values) for term in timed)
            then = view.later(_sum(each, view.point_m.shape[:2]))
            shown = view.of(then.point_m + _displaced(placed, then))
        return shown.point_m - view.point_m

    def shaking(self, contact: Contact) -> Array:
        """Returns the standard deviation (n,), m/s², of the sum of the random pushes."""
        each = (np.square(term.effect.shaking(contact, term.values)) for term in self.acting("shaking"))
        return np.sqrt(_sum(each, (len(contact),)))

    def delay_s(self) -> float:
        """Returns the delay of the camera's stamps, s: the sum of all effects'."""
        return sum(term.effect.delay_s(term.values) for term in self.acting("delay_s"))

    def arm_delay_s(self) -> float:
        """Returns the part of it by which the arm's stamps are early, s."""
        return sum(term.effect.arm_delay_s(term.values) for term in self.acting("delay_s"))

    def arm_m(self) -> Array:
        """Returns the arm (3,), m, from the plate's true pivot to the configured one."""
        return _sum((term.effect.arm_m(term.values) for term in self.acting("push")), (3,))

    def with_term(self, term: Term) -> Model:
        """Returns the model with one more term, or with the term of that effect replaced."""
        others = tuple(known for known in self.terms if known.effect.id != term.effect.id)
        return replace(self, terms=(*others, term))


def _displaced(terms: Iterable[Term], view: View) -> Array:
    """Returns the sum of the terms' displacements (n, 4, 2), m."""
    return _sum((term.effect.seen(view, term.values) for term in terms), view.point_m.shape)


def _sum(parts: Iterable[Array | float | None], shape: tuple[int, ...]) -> Array:
    total = np.zeros(shape)
    for part in parts:
        if part is not None:
            total += part
    return total


# --- as a table of model.toml ---------------------------------------------------------------------------------------


def model_of_table(table: Mapping[str, Any], known: Catalogue) -> Model:
    """Returns the model that a parsed model.toml describes.

        [friction]
        mu_s = 0.36
        scatter = 0.12
        [effects.contact_aging]
        per_decade = 0.031

    A parameter that is left out is at its null, or a shape where its effect starts: a law may gain parameters. Terms
    without a name stand in tables [[smooth]], see `smooth_table`.

    Raises:
        UserError: for an unknown key, effect or parameter, an effect without a size, or a value outside its bounds.
    """
    only(table, {"friction", "effects", "smooth", "about"}, "a model")
    friction = table.get("friction", {})
    only(friction, {"mu_s", "scatter"}, "[friction]")
    if "mu_s" not in friction:
        raise UserError("Expected mu_s in the table [friction] of the model, found none")
    mu_s = number(friction["mu_s"], "friction.mu_s", lambda value: 0 < value < 20, "a number between 0 and 20")
    scatter = number(
        friction.get("scatter", 0.0), "friction.scatter", lambda value: 0 <= value < 1, "a number from 0 to less than 1"
    )
    terms = [_term(name, values, known) for name, values in a_table(table.get("effects", {}), "effects").items()]
    terms += [Term(*each) for each in smooth_of_tables(table.get("smooth", []))]
    return Model(mu_s=mu_s, scatter=scatter, terms=tuple(terms))


def table_of_model(model: Model) -> dict[str, Any]:
    """Returns the tables of model.toml."""
    named = [term for term in model.terms if not isinstance(term.effect, Unnamed)]
    table: dict[str, Any] = {
        "friction": {"mu_s": model.mu_s, "scatter": model.scatter},
        "effects": {term.effect.id: dict(term.values) for term in named},
    }
    unnamed = [table_of_smooth(term.effect, term.values) for term in model.terms if isinstance(term.effect, Unnamed)]
    return table | ({"smooth": unnamed} if unnamed else {})


def _term(name: str, values: Mapping[str, Any], known: Catalogue) -> Term:
    if name not in known:
        raise UserError(f"Expected one of the effects {', '.join(sorted(known))}, got {name}")
    effect = known[name]
    only(values, {parameter.name for parameter in effect.parameters}, f"[effects.{name}]")
    chosen = effect.neutral()
    sizes = {one.name: f"{one.name}{one.in_unit}" for one in effect.parameters if not one.is_shape}
    if not set(sizes) & set(values):
        raise UserError(f"Expected {' or '.join(sizes.values())} in [effects.{name}], found none")
    for parameter in effect.parameters:
        if parameter.name in values:
            chosen[parameter.name] = number(
                values[parameter.name],
                f"effects.{name}.{parameter.name}",
                lambda value, of=parameter: of.low <= value <= of.high,
                parameter.expected,
            )
    return Term(effect, chosen)
