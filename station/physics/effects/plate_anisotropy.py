"""Anisotropy of the plate: an elliptic limit curve that is fixed to the plate's own grain.

With ψ = way − mount, m(ψ)² = cosh r + (sinh r / r)(c cos 2ψ + s sin 2ψ), r = hypot(c, s): the support function of an
ellipse whose axes multiply to 1 (mu_s stays their geometric mean) and have the ratio exp(r), the larger one at
ψ = atan2(s, c) / 2. The two components are smooth at the null, and every value is convex. The plate can be turned in
its mount while the camera and the arm stay: the grain turns with it.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter


class PlateAnisotropy(Effect):
    """Friction depends on the direction in the plate's frame."""

    id: ClassVar[str] = "plate_anisotropy"
    title: ClassVar[str] = "anisotropy fixed to the plate"
    law: ClassVar[str] = (
        "elliptic limit curve in the plate's grain; (cos2, sin2) = ln(axes' ratio) at twice its angle (0, 0)"
    )
    source: ClassVar[str] = "Goyal, Ruina, Papadopoulos 1991, Wear 143, 307; Ma & Rodriguez 2018"
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "direction law"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="cos2", unit="1", low=-0.7, high=0.7, typical=0.1),
        Parameter(name="sin2", unit="1", low=-0.7, high=0.7, typical=0.1),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("object_anisotropy", "cone_artifact")
    separated_by: ClassVar[str] = "the plate remounted at 45° or 90°, and tilts in directions drawn at random"

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """See the module."""
        twice = 2.0 * (contact.way_rad - contact.mount_rad)
        size = float(np.hypot(values["cos2"], values["sin2"]))
        wave = values["cos2"] * np.cos(twice) + values["sin2"] * np.sin(twice)
        return np.sqrt(np.cosh(size) + (np.sinh(size) / size if size > 0 else 1.0) * wave)
