"""The free numbers of a model as a vector, in units of their typical sizes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.likelihood.systematic import is_nuisance, nuisances
from station.diagnosis.observations.evidence import Evidence
from station.physics.contact import Array
from station.physics.effect import Effect
from station.physics.model import Model, Term
from station.physics.parameter import Parameter


@dataclass(frozen=True, slots=True)
class Free:
    """One free number: ln mu_s (`effect` None), or a parameter of an effect."""

    effect: Effect | None
    parameter: Parameter | None

    @property
    def name(self) -> tuple[str, str] | None:
        """The ids of the effect and of its parameter; None for ln mu_s."""
        return (self.effect.id, self.parameter.name) if self.effect and self.parameter else None

    @property
    def low(self) -> float:
        """Lower bound, scaled."""
        return -math.inf if self.parameter is None else self.parameter.low / self.scale

    @property
    def high(self) -> float:
        """Upper bound, scaled."""
        return math.inf if self.parameter is None else self.parameter.high / self.scale

    @property
    def precision(self) -> float:
        """Precision of the scaled prior: 1 for a nuisance, whose typical size is its prior's sd.

        A number may bring a prior of its own (`Parameter.sd`). An effect that mu absorbs has the prior that it would
        have as a nuisance: a sensor that sees tilts in one direction tells the scale of an angle, and nothing its
        offset, which would go wherever noise or another law's misfit leads it. It is 0 for others.
        """
        if self.parameter is not None and self.parameter.sd:
            return (self.scale / self.parameter.sd) ** 2
        if self.effect is None or self.is_shape:
            return 0.0
        if is_nuisance(self.effect):
            return 1.0
        return thresholds.PLAUSIBLE**-2 if self.effect.absorbed_by_mu else 0.0

    @property
    def is_shape(self) -> bool:
        """True if the number has no meaning without its effect's size."""
        return self.parameter is not None and self.parameter.is_shape

    @property
    def scale(self) -> float:
        """The number's unit: its typical size; 1 for ln mu_s."""
        return 1.0 if self.parameter is None else self.parameter.typical


def free_numbers(evidence: Evidence, model: Model, effects: Sequence[Effect]) -> tuple[Free, ...]:
    """Gives ln mu_s, then the parameters of the model's nuisances and of the effects, without unidentifiable shapes."""
    every = [*nuisances(evidence, model), *effects]
    numbers = (Free(effect, parameter) for effect in every for parameter in identifiable(evidence, effect))
    return (Free(None, None), *numbers)


def identifiable(evidence: Evidence, effect: Effect) -> tuple[Parameter, ...]:
    """Returns the effect's parameters without the shapes that are not identifiable in these runs."""
    contact = evidence.contact()
    idle = effect.idle(contact) if contact is not None else frozenset[str]()
    return tuple(parameter for parameter in effect.parameters if parameter.name not in idle)


def vector_of(model: Model, free: Sequence[Free]) -> Array:
    """Returns the scaled values (k,) of a model's free numbers; an effect that it lacks is neutral."""
    return np.array([_value(model, number) / number.scale for number in free])


def _value(model: Model, number: Free) -> float:
    if number.effect is None or number.parameter is None:
        return math.log(model.mu_s)
    for term in model.terms:
        if term.effect.id == number.effect.id:
            return term.values[number.parameter.name]
    return number.parameter.neutral


def moved(model: Model, number: Free, by: float) -> Model:
    """Returns the model with one free number moved by `by` of its scales, clipped to its bounds."""
    if number.effect is None or number.parameter is None:
        return replace(model, mu_s=model.mu_s * math.exp(by))
    values = next((term.values for term in model.terms if term.effect.id == number.effect.id), number.effect.neutral())
    value = number.parameter.clipped(values[number.parameter.name] + by * number.scale)
    return model.with_term(Term(number.effect, {**values, number.parameter.name: value}))


def model_of(vector: Array, free: Sequence[Free], *, base: Model) -> Model:
    """Returns the base model with the free numbers set to `vector` (k,), clipped to their bounds."""
    model = base
    values: dict[str, dict[str, float]] = {}
    effects: dict[str, Effect] = {}
    for scaled, number in zip(vector.tolist(), free, strict=True):
        if number.effect is None or number.parameter is None:
            model = replace(model, mu_s=math.exp(min(max(scaled, -6.0), 4.0)))
        else:
            effects[number.effect.id] = number.effect
            values.setdefault(number.effect.id, {})[number.parameter.name] = number.parameter.clipped(
                scaled * number.scale
            )
    known = {term.effect.id: term.values for term in base.terms}
    for name, chosen in values.items():
        # A parameter that is not free keeps its value.
        kept = known.get(name, effects[name].neutral())
        model = model.with_term(Term(effects[name], {**kept, **chosen}))
    return model
