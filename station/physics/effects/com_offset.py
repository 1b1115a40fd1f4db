"""Offset of the mass: the block's centre of mass is not over the centre of its contact.

With d the offset (bx, by in the block's frame, turned by yaw), e the way, friction acting at the contact's centre:

- at rest, the moment d × F takes its share of the limit surface |F|² + (d × F)² / r² = (mu N)², so that
  h² = mu² (1 − (d × e)² / (r² + d²)): an ellipse, narrow across the offset; r = 0.38 √A, the mean distance of a
  square's contact from its centre;
- in the slide, friction of about g sin θ at the distance −d from the centre of mass turns the block,
  α = g sin θ (d × e) / k², k² = A/6 the square's radius of gyration: a mass that leads keeps straight, one that trails
  swings round. What resists the turning in the contact, and that sliding meets the less friction for it, is the
  simulator's on the same limit surface, as for any turning block: no factor says it once more.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.circle import cos_sin
from station.physics.contact import GRAVITY_M_S2, Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter

MEAN_DISTANCE = 0.3826
"""Of a unit square's points from its centre."""


class ComOffset(Effect):
    """The centre of mass is off the contact's centre."""

    id: ClassVar[str] = "com_offset"
    title: ClassVar[str] = "offset of the centre of mass"
    law: ClassVar[str] = (
        "the mass is at (bx, by) in the block's frame: a moment at the onset, a turn in the slide (0, 0)"
    )
    source: ClassVar[str] = (
        "Goyal, Ruina, Papadopoulos 1991, Wear 143, 307; Howe & Cutkosky 1996, IJRR 15, 557 (ellipsoid)"
    )
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "direction law"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="x_m", unit="m", low=-5e-3, high=5e-3, typical=1e-3),
        Parameter(name="y_m", unit="m", low=-5e-3, high=5e-3, typical=1e-3),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("object_anisotropy", "platform_level")
    separated_by: ClassVar[str] = (
        "the yaw rate against the speed of sliding, with the block turned by 180° between runs"
    )

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """See the module."""
        if contact.moving.all():
            return 1.0
        square = values["x_m"] ** 2 + values["y_m"] ** 2
        reach = MEAN_DISTANCE**2 * contact.area_m2 + square
        return np.where(contact.moving, 1.0, np.sqrt(1.0 - _arm_m(contact, values) ** 2 / reach))

    def spin(self, contact: Contact, values: Values) -> Array | float:
        """See the module."""
        _, sine = cos_sin(contact.tilt_rad)
        turned = GRAVITY_M_S2 * sine * _arm_m(contact, values) / (contact.area_m2 / 6.0)
        return turned if contact.moving.all() else np.where(contact.moving, turned, 0.0)


def _arm_m(contact: Contact, values: Values) -> Array:
    """The offset's part across the way, d × e (n,)."""
    along = contact.way_rad - contact.yaw_rad
    cosine, sine = cos_sin(along)
    return values["x_m"] * sine - values["y_m"] * cosine
