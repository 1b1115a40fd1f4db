"""Each run's own level of friction, by which a run that is simulated again begins to slide where it did."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.model import Model
from station.physics.parameter import Parameter


class OwnLevel(Effect):
    """A factor on the friction of each run: no physics, but each run's random effect as it was."""

    id: ClassVar[str] = "own_level"
    title: ClassVar[str] = "each run's own level of friction"
    law: ClassVar[str] = "friction times a factor of the run (on = 0)"
    source: ClassVar[str] = "none: it is fitted to each run's onset"
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "history"
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter(name="on", unit="1", low=0.0, high=1.0, typical=1.0),)
    separated_by: ClassVar[str] = "nothing: it repairs every onset"

    def __init__(self, factor: Array) -> None:
        """Takes `factor` (m,) by the run's number, counted from 0 at the first of the runs."""
        self._factor = factor

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """Returns the factor (n,) of each moment's run."""
        del values
        return self._of(contact.run)

    def of_run(self, number: float) -> float:
        """Returns the factor of the run with this number."""
        return float(self._of(np.array(number)))

    def _of(self, numbers: Array) -> Array:
        return self._factor[np.clip(np.rint(numbers).astype(int), 0, len(self._factor) - 1)]


def without_own_level(model: Model, run: float) -> tuple[Model, float]:
    """Returns the model without a level of the runs' own, and that of the run with this number: 1 where there is none.

    The factor is the same at every state: whoever asks for friction step by step need not work the state out for it.
    """
    levels = [term.effect for term in model.acting("friction") if isinstance(term.effect, OwnLevel)]
    if not levels:
        return model, 1.0
    rest = tuple(term for term in model.terms if not isinstance(term.effect, OwnLevel))
    return replace(model, terms=rest), float(np.prod([level.of_run(run) for level in levels]))
