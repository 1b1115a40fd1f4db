"""Kinetic drop: a sliding block meets less friction than one at rest.

mu_k = (1 − d) mu_s from the first moment of the slide on. Friction that would grow at the onset (d < 0) is not allowed:
a block that starts would stop at once, so it would never be seen to start.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter


class KineticDrop(Effect):
    """Friction falls at once when the slide begins."""

    id: ClassVar[str] = "kinetic_drop"
    title: ClassVar[str] = "kinetic friction below static"
    law: ClassVar[str] = "mu_k = (1 - d) mu_s while sliding (d = 0)"
    source: ClassVar[str] = "Coulomb 1785, Théorie des machines simples; Aira et al. 2014 (pine: mu_s/mu_k 1.4–1.5)"
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "speed law"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="drop", symbol="d", unit="1", low=0.0, high=0.6, typical=0.1),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("stribeck", "contact_aging", "clock_offset", "pivot_offset")
    separated_by: ClassVar[str] = "the shape of the first 100 ms of the slide together with the whole slide"
    demonstrated: ClassVar[Values] = {"drop": 0.3}

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """Gives the factor (n,) on friction by the law of this module."""
        return np.where(contact.moving, 1.0 - values["drop"], 1.0)
