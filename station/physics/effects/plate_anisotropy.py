"""Anisotropy of the plate: a grain that is fixed to the plate (see station/physics/grain.py).

The plate can be turned in its mount while the camera and the arm stay: the grain turns with it.
"""

from __future__ import annotations

from typing import ClassVar

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.grain import PARAMETERS, grain
from station.physics.parameter import Parameter


class PlateAnisotropy(Effect):
    """Friction depends on the direction in the plate's frame."""

    id: ClassVar[str] = "plate_anisotropy"
    title: ClassVar[str] = "anisotropy fixed to the plate"
    law: ClassVar[str] = (
        "limit curve with two hard directions in the plate's grain; "
        "(cos2, sin2) = ln(extremes' ratio) at twice the angle (0, 0)"
    )
    source: ClassVar[str] = "Goyal, Ruina, Papadopoulos 1991, Wear 143, 307; Zmitrowicz 2006; Ma & Rodriguez 2018"
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "direction law"
    parameters: ClassVar[tuple[Parameter, ...]] = PARAMETERS
    confounded_with: ClassVar[tuple[str, ...]] = ("object_anisotropy", "cone_artifact")
    separated_by: ClassVar[str] = "the plate remounted at 45° or 90°, and tilts in directions drawn at random"
    demonstrated: ClassVar[Values] = {"cos2": 0.3}

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """Gives the factor (n,) on friction by the law of this module."""
        return grain(contact.way_rad - contact.mount_rad, values)
