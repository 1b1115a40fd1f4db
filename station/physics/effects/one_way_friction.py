"""One-way friction: napped, scaly or brushed surfaces hold better against the grain than along it.

The grain is the plate's, and turns with its mount, or (`with_block` = 1) the block's, and turns with its yaw. With
ψ = way − grain, m(ψ) = 1 + c cos ψ + s sin ψ + ½ p (c sin ψ − s cos ψ)². p = 0 is a circle whose centre is off the
origin: a first harmonic adds nothing to h + h''. p = 1 is, to second order, the curve whose radius, the force that is
held, is 1 + a cos ψ; h + h'' = 1 + ½ p a² (2 − 3 sin²) stays positive within the bounds. The origin stays inside, so
friction never drives.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter


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
        Parameter(name="cos1", unit="1", low=-0.5, high=0.5, typical=0.1),
        Parameter(name="sin1", unit="1", low=-0.5, high=0.5, typical=0.1),
        Parameter(name="pinch", unit="1", low=0.0, high=1.5, typical=0.5, null=None, starts=(0.0,)),
        Parameter(name="with_block", unit="1", low=0.0, high=1.0, typical=1.0, null=None, starts=(0.0, 1.0)),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("platform_level", "friction_patch")
    separated_by: ClassVar[str] = (
        "the plate turned by 180° in its mount: the grain turns with it, the level error does not"
    )

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """See the module."""
        grain = values["with_block"] * (contact.yaw_rad - contact.mount_rad) + contact.mount_rad
        along = contact.way_rad - grain
        c, s = np.cos(along), np.sin(along)
        across = values["cos1"] * s - values["sin1"] * c
        return 1.0 + values["cos1"] * c + values["sin1"] * s + 0.5 * values["pinch"] * across**2
