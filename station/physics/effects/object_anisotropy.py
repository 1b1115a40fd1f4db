"""Anisotropy of the object: an elliptic limit curve that turns with the block.

With ψ = way − yaw, m(ψ)² = cosh r + (sinh r / r)(c cos 2ψ + s sin 2ψ), r = hypot(c, s): the support function of an
ellipse whose axes multiply to 1 (mu_s stays their geometric mean) and have the ratio exp(r), the larger one at
ψ = atan2(s, c) / 2. The two components are smooth at the null, where an angle would be without meaning, and every
value is convex.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter


class ObjectAnisotropy(Effect):
    """Friction depends on the direction in the block's frame."""

    id: ClassVar[str] = "object_anisotropy"
    title: ClassVar[str] = "anisotropy fixed to the object"
    law: ClassVar[str] = (
        "elliptic limit curve in the block's frame; (cos2, sin2) = ln(axes' ratio) at twice its angle (0, 0)"
    )
    source: ClassVar[str] = "Goyal, Ruina, Papadopoulos 1991, Wear 143, 307; Ma & Rodriguez 2018"
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "direction law"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="cos2", unit="1", low=-0.7, high=0.7, typical=0.1),
        Parameter(name="sin2", unit="1", low=-0.7, high=0.7, typical=0.1),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("plate_anisotropy", "com_offset")
    separated_by: ClassVar[str] = "the block turned between runs, so that its yaw varies against the plate"

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """See the module."""
        twice = 2.0 * (contact.way_rad - contact.yaw_rad)
        size = float(np.hypot(values["cos2"], values["sin2"]))
        wave = values["cos2"] * np.cos(twice) + values["sin2"] * np.sin(twice)
        return np.sqrt(np.cosh(size) + (np.sinh(size) / size if size > 0 else 1.0) * wave)
