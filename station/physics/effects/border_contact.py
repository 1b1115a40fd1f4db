"""Border: the soft foam round the plate's opening pushes a block back that runs into it.

Per mass, inwards: (k p + c v_out) / m, p how deep the block stands in the foam, v_out its speed outwards; never
outwards. Inwards is towards P's origin, which is right where the opening is round. The spring gives the rebound, the
damping the loss.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values, unit
from station.physics.parameter import Parameter


class BorderContact(Effect):
    """The foam border resists."""

    id: ClassVar[str] = "border_contact"
    title: ClassVar[str] = "contact with the border"
    law: ClassVar[str] = (
        "in the foam, which begins a lip before its nominal edge, a force k depth + c speed inwards (k = c = 0)"
    )
    source: ClassVar[str] = (
        "Dressel et al., section III.B and figure 2 (foam border); Kelvin–Voigt contact, Hunt & Crossley 1975"
    )
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "place"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="stiffness_n_m", unit="N/m", low=0.0, high=1000.0, typical=20.0),
        Parameter(name="damping_n_s_m", unit="N s/m", low=0.0, high=5.0, typical=0.1),
        Parameter(name="lip_m", unit="m", low=0.0, high=0.012, typical=3e-3, null=None, starts=(0.0, 3e-3, 6e-3)),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("friction_patch",)
    separated_by: ClassVar[str] = "slides that end well inside the opening beside slides that reach the border"

    def push(self, contact: Contact, values: Values) -> Array | None:
        """Gives the force per mass (n, 3), m/s², by the law of this module."""
        outward = np.arctan2(contact.y_m, contact.x_m)
        leaving = np.where(contact.moving, contact.speed_m_s, 0.0) * np.cos(contact.way_rad - outward)
        depth = np.maximum(values["lip_m"] - contact.border_m, 0.0)
        force = np.maximum(values["stiffness_n_m"] * depth + values["damping_n_s_m"] * leaving, 0.0)
        inward = np.where(depth > 0.0, force / contact.mass_kg, 0.0)
        return np.column_stack([-inward[:, None] * unit(outward), np.zeros(len(contact))])
