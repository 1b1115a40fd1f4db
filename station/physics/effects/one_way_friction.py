"""One-way friction: napped, scaly or brushed surfaces hold better against the grain than along it.

The grain is the plate's, and turns with its mount, or (`with_block` = 1) the block's, and turns with its yaw. With
ψ = way − grain and p = 0, m(ψ) = 1 + c cos ψ + s sin ψ: a circle whose centre is off the origin. Pinched, with
a = hypot(c, s) and ψ from the axis, the force that is held is a cos ψ + √(1 − (1 − p) a² sin² ψ): the same circle at
p = 0, 1 + a cos ψ at p = 1. It is convex for p ≤ ((1 − a) / a)², which is enforced; the origin stays inside, so
friction never drives.

Asperities that are inclined obey the principle of maximum dissipation, and push a block sideways by the slope of m
(`sideways` = 1). Bristles bend the way that they are dragged, and pull straight back however stiff they are that way:
there is no force across (0). A nap may do both.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from station.physics.circle import cos_sin
from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.held import NEARLY_FLAT, support_of
from station.physics.parameter import Parameter

TURNED_RAD = 0.05
"""The scatter of the block's yaw on the plate above which its nap can be told from the plate's."""


class OneWayFriction(Effect):
    """Friction differs between one direction and the opposite one."""

    id: ClassVar[str] = "one_way_friction"
    title: ClassVar[str] = "one-way friction"
    law: ClassVar[str] = (
        "mu(way) = mu_s (1 + c cos way + s sin way) in the plate's grain, or in the block's (c = s = 0)"
    )
    source: ClassVar[str] = "Zmitrowicz 2006, Int. J. Solids Struct. 43, 4407 (non-centrosymmetric friction)"
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "direction law"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="cos1", symbol="c", unit="1", low=-0.5, high=0.5, typical=0.1),
        Parameter(name="sin1", symbol="s", unit="1", low=-0.5, high=0.5, typical=0.1),
        Parameter(name="pinch", unit="1", low=0.0, high=1.0, typical=0.5, null=None, starts=(0.0,)),
        Parameter(name="with_block", unit="1", low=0.0, high=1.0, typical=1.0, null=None, starts=(0.0, 1.0)),
        Parameter(name="sideways", unit="1", low=0.0, high=1.0, typical=1.0, null=None, starts=(1.0, 0.0)),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("platform_level", "friction_patch")
    separated_by: ClassVar[str] = (
        "the plate turned by 180° in its mount: the grain turns with it, the level error does not"
    )
    demonstrated: ClassVar[Values] = {"cos1": 0.3}

    def idle(self, contact: Contact) -> frozenset[str]:
        """Returns the nap's frame, if the block always has the same heading on the plate.

        Its nap and the plate's are then one.
        """
        turned = np.exp(1j * (contact.yaw_rad - contact.mount_rad))
        alike = len(contact) == 0 or float(np.abs(np.mean(turned))) > 1.0 - 0.5 * TURNED_RAD**2
        return frozenset({"with_block"}) if alike else frozenset()

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """Gives the factor (n,) on friction by the law of this module."""
        grain = values["with_block"] * (contact.yaw_rad - contact.mount_rad) + contact.mount_rad
        size = math.hypot(values["cos1"], values["sin1"])
        along = contact.way_rad - grain - math.atan2(values["sin1"], values["cos1"])
        if values["pinch"] == 0.0 or size == 0.0:
            return 1.0 + size * np.cos(along)
        pinched = min(values["pinch"] * size**2, NEARLY_FLAT * (1.0 - size) ** 2)
        return support_of(_Nap(size, size**2 - pinched), along)

    def steering(self, contact: Contact, values: Values) -> Array | float:
        """Gives the factor (n,) on the curve that steers: that on friction to the power of `sideways`."""
        return self.friction(contact, values) ** values["sideways"]


@dataclass(frozen=True, slots=True)
class _Nap:
    """The limit curve by its radius, with angles counted from its larger extreme; `round` is (1 − p) a²."""

    size: float
    round: float
    folds: int = 1

    def radius(self, angle_rad: Array) -> Array:
        """Returns r (n,) at angles (n,)."""
        wave, across = cos_sin(angle_rad)
        return self.size * wave + np.sqrt(1.0 - self.round * across**2)

    def slopes(self, angle_rad: Array) -> tuple[Array, Array]:
        """Returns d ln r / dψ and d² ln r / dψ² (n,)."""
        wave, across = cos_sin(angle_rad)
        root = np.sqrt(1.0 - self.round * across**2)
        radius = self.size * wave + root
        product = self.round * wave * across / root
        slope = -(self.size * across + product) / radius
        bend = -(self.size * wave + self.round * (wave**2 - across**2) / root + product**2 / root) / radius
        return slope, bend - slope**2
