"""What the measurement itself may have wrong by a little in all runs: a nuisance with a known size, never a finding.

An onset is read by fitting a slide back to zero velocity. Creep, a late stamp, a rounded corner of the tilt shift all
onsets of a session alike by some hundredths of a degree. With hundreds of runs that would be told from the slides'
friction, and be called a kinetic coefficient.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.gap.evidence.evidence import Evidence
from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.model import Model
from station.physics.parameter import Parameter

PRIOR = 0.003
"""Standard deviation of the shift, relative: 0.06° at a tilt of 20°."""


class OnsetReading(Effect):
    """All onsets are read a little early or late."""

    id: ClassVar[str] = "_onset_reading"
    title: ClassVar[str] = "reading of the onsets"
    law: ClassVar[str] = "static friction reads (1 + shift) times what it is (shift = 0)"
    source: ClassVar[str] = "none: a nuisance of the measurement"
    layer: ClassVar[Layer] = "rig"
    family: ClassVar[Family] = "level"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="shift", unit="1", low=-0.1, high=0.1, typical=PRIOR),
    )
    separated_by: ClassVar[str] = "nothing: it is allowed for"

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """See the class."""
        return np.where(contact.moving, 1.0, 1.0 + values["shift"])


ONSET_READING = OnsetReading()


def nuisances(evidence: Evidence) -> tuple[Effect, ...]:
    """Those that matter for an evidence: where there are no slides, the reading of the onsets is part of mu."""
    return (ONSET_READING,) if evidence.channel("onset") and evidence.channel("along") else ()


def is_nuisance(effect: Effect) -> bool:
    """Whether it is allowed for and never claimed."""
    return effect.id.startswith("_")


def without_nuisances(model: Model) -> Model:
    """The model as a user wants it."""
    terms = tuple(term for term in model.terms if not is_nuisance(term.effect))
    return Model(mu_s=model.mu_s, scatter=model.scatter, terms=terms)
