"""Anisotropy of the object: a grain that turns with the block (see station/physics/grain.py)."""

from __future__ import annotations

from typing import ClassVar

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.grain import PARAMETERS, grain
from station.physics.parameter import Parameter


class ObjectAnisotropy(Effect):
    """Friction depends on the direction in the block's frame."""

    id: ClassVar[str] = "object_anisotropy"
    title: ClassVar[str] = "anisotropy fixed to the object"
    law: ClassVar[str] = (
        "limit curve with two hard directions in the block's frame; "
        "(cos2, sin2) = ln(extremes' ratio) at twice the angle (0, 0)"
    )
    source: ClassVar[str] = "Goyal, Ruina, Papadopoulos 1991, Wear 143, 307; Zmitrowicz 2006; Ma & Rodriguez 2018"
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "direction law"
    parameters: ClassVar[tuple[Parameter, ...]] = PARAMETERS
    confounded_with: ClassVar[tuple[str, ...]] = ("plate_anisotropy", "uneven_contact")
    separated_by: ClassVar[str] = "the block turned between runs, so that its yaw varies against the plate"
    demonstrated: ClassVar[Values] = {"cos2": 0.3}

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """Gives the factor (n,) on friction by the law of this module."""
        return grain(contact.way_rad - contact.yaw_rad, values)
