"""Viscous drag: a force against the motion in proportion to the speed, whatever the normal force.

a = −(c / m) v. Lubricated, wet and very light blocks show it. c < 0 would feed energy in and is not allowed.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values, unit
from station.physics.parameter import Parameter


class Viscous(Effect):
    """Drag in proportion to the speed."""

    id: ClassVar[str] = "viscous"
    title: ClassVar[str] = "viscous drag"
    law: ClassVar[str] = "force -c v along the motion (c = 0)"
    source: ClassVar[str] = (
        "Newton's law of viscosity; Armstrong-Hélouvry, Dupont, Canudas de Wit 1994, Automatica 30, 1083"
    )
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "speed law"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="drag_n_s_m", unit="N s/m", low=0.0, high=2.0, typical=0.02),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("stribeck", "rate_strengthening")
    separated_by: ClassVar[str] = "a wide range of speeds (coarser tilt steps, longer slides), and a second mass"

    def push(self, contact: Contact, values: Values) -> Array | None:
        """See the module."""
        slowing = np.where(contact.moving, values["drag_n_s_m"] / contact.mass_kg * contact.speed_m_s, 0.0)
        return np.column_stack([-slowing[:, None] * unit(contact.way_rad), np.zeros(len(contact))])
