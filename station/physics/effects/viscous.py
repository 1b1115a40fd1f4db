"""Viscous drag: a force against the motion in proportion to the speed.

a = −(c / m) (m / 8 g)^q v. A film of fluid drags alike whatever presses on it (q = 0); where the load makes the film's
area, or the contact itself flows, the drag grows with it (q up to 1). Lubricated, wet and very light blocks show it.
c < 0 would feed energy in and is not allowed.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter

REFERENCE_KG = 0.008


class Viscous(Effect):
    """Drag in proportion to the speed."""

    id: ClassVar[str] = "viscous"
    title: ClassVar[str] = "viscous drag"
    law: ClassVar[str] = "force -c v (m / 8 g)^q along the motion (c = 0)"
    source: ClassVar[str] = (
        "Newton's law of viscosity; Armstrong-Hélouvry, Dupont, Canudas de Wit 1994, Automatica 30, 1083"
    )
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "speed law"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="drag_n_s_m", symbol="c", unit="N s/m", low=0.0, high=2.0, typical=0.02),
        Parameter(name="by_load", symbol="q", unit="1", low=0.0, high=1.0, typical=1.0, null=None, starts=(0.0, 1.0)),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("stribeck", "rate_strengthening")
    separated_by: ClassVar[str] = "a wide range of speeds (coarser tilt steps, longer slides), and a second mass"
    demonstrated: ClassVar[Values] = {"drag_n_s_m": 0.06}

    def idle(self, contact: Contact) -> frozenset[str]:
        """Returns the exponent, if all runs have one mass: it and the drag are then one number."""
        return frozenset({"by_load"}) if len(contact) == 0 or np.ptp(contact.mass_kg) == 0.0 else frozenset()

    def push(self, contact: Contact, values: Values) -> Array | None:
        """Gives the force per mass (n, 3), m/s², by the law of this module."""
        drag = values["drag_n_s_m"] * (contact.mass_kg / REFERENCE_KG) ** values["by_load"]
        slowing = np.where(contact.moving, drag / contact.mass_kg * contact.speed_m_s, 0.0)
        return np.column_stack([-slowing[:, None] * contact.way, np.zeros(len(contact))])
