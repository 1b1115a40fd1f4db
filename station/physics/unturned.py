"""A model without what the moment on a block at rest takes of its friction: a simulator lets that moment act itself."""

from __future__ import annotations

from dataclasses import replace

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Values
from station.physics.model import Model, Term


class Unturned(Effect):
    """The friction of an effect beside which its own moment acts."""

    def __init__(self, effect: Effect) -> None:
        """Takes the effect."""
        self._effect = effect
        vars(self).update(id=effect.id)  # others have it in their class

    def acts_through(self) -> frozenset[str]:
        """Returns the friction, where the effect has any."""
        return self._effect.acts_through() & {"friction"}

    def is_null(self, values: Values) -> bool:
        """Returns true if the effect vanishes."""
        return self._effect.is_null(values)

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """Returns the factor (n,) beside the moment."""
        return self._effect.unturned(contact, values)


def unturned(model: Model) -> Model:
    """Returns the model whose friction is that of a block at rest beside the moment that acts on it."""
    return replace(model, terms=tuple(_unturned(term) for term in model.terms))


def _unturned(term: Term) -> Term:
    turns = term.effect.acts_through() & {"spin", "lever"}
    return replace(term, effect=Unturned(term.effect)) if turns else term
