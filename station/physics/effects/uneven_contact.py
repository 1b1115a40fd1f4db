"""Uneven contact: friction differs over the sole (a worn corner, dust, three points that carry), and the block turns.

Friction's resultant acts at a = (ax, ay) from the point under the mass, in the block's frame, turned by its yaw. With e
the way and F = −f e the friction per mass:

- in the slide its moment a × F turns the block, k² ω′ = −f a × e, k² = A / 6 a square's radius of gyration: the
  simulator takes the arm −a × e and its own f (`lever`), and what resists the turning (`sole`);
- at rest the moment takes its share of the limit surface |F|² + M² / (ρ² + a²) = (mu N)², so that
  h² = mu² (1 − (a × e)² / (ρ² + a²)), ρ² = A / 12.

Where friction grows linearly over a flat square sole by g per metre, a = g A / 12. The pressure under a tall block
leads by s = h F / N (see `com_offset`), mu h for the height h of its mass, and meets the friction there: with
`lead` = s / √A the block meets 1 + g · s = 1 + 12 lead (a · e) / √A of the friction one way, and as much less the
opposite way. All of it opposes the motion, whatever its direction: this part steers no block. The moment is that of a
flat block, so that the arm of the larger friction is the smaller one. What a lead does to any block that turns is no
part of this law (`sole`). With tests/unit/physics/test_contact_points.py, a block on many points, the way agrees to
2 %, and the turn to 2 % of a flat block's; with the lead's own part to a tenth of a cube's.

From contact to contact the arm differs: what all runs have in common is meant here, the rest is the turns' scatter from
run to run.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.circle import cos_sin
from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter
from station.physics.sole import left_beside_moment

LEAST = 0.1
"""The least share of its friction that a block keeps: no sole is so uneven."""


class UnevenContact(Effect):
    """Friction differs over the sole."""

    id: ClassVar[str] = "uneven_contact"
    title: ClassVar[str] = "friction that differs over the sole"
    law: ClassVar[str] = "friction acts at (ax, ay) from the mass, in the block's frame: it turns the block (0, 0)"
    source: ClassVar[str] = (
        "Goyal, Ruina, Papadopoulos 1991, Wear 143, 307; Howe & Cutkosky 1996, IJRR 15, 557 (ellipsoid)"
    )
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "direction law"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="x_m", symbol="ax", unit="m", low=-5e-3, high=5e-3, typical=5e-4),
        Parameter(name="y_m", symbol="ay", unit="m", low=-5e-3, high=5e-3, typical=5e-4),
        Parameter(name="lead", unit="1", low=0.0, high=0.5, typical=0.2, null=None, starts=(0.0,)),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("object_anisotropy", "one_way_friction")
    separated_by: ClassVar[str] = (
        "the yaw rate against the speed of sliding, with the block turned by 180° between runs"
    )
    demonstrated: ClassVar[Values] = {"x_m": 0.0015}

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """Gives the factor (n,) on friction by the law of this module."""
        return self.steering(contact, values) * _in_front(contact, values)

    def steering(self, contact: Contact, values: Values) -> Array | float:
        """Gives the factor (n,) on the curve that steers: a block at rest gives way to the moment."""
        if contact.moving.all():
            return 1.0
        square = values["x_m"] ** 2 + values["y_m"] ** 2
        left = left_beside_moment(_across_m(contact, values), square, contact.area_m2)
        return np.where(contact.moving, 1.0, left)

    def unturned(self, contact: Contact, values: Values) -> Array | float:
        """Gives the factor (n,) on friction beside which the moment acts."""
        return _in_front(contact, values)

    def lever(self, contact: Contact, values: Values) -> Array | float:
        """Gives the lever (n,), m, of the friction by the law of this module."""
        arm = -_across_m(contact, values) / _in_front(contact, values)
        return arm if contact.moving.all() else np.where(contact.moving, arm, 0.0)


def _across_m(contact: Contact, values: Values) -> Array:
    """Returns the arm's part across the way, a × e (n,)."""
    cosine, sine = cos_sin(contact.way_rad - contact.yaw_rad)
    return values["x_m"] * sine - values["y_m"] * cosine


def _in_front(contact: Contact, values: Values) -> Array:
    """Returns the friction where the pressure leads to, over that under the mass (n,)."""
    cosine, sine = cos_sin(contact.way_rad - contact.yaw_rad)
    along_m = values["x_m"] * cosine + values["y_m"] * sine
    return np.maximum(1.0 + 12.0 * values["lead"] * along_m / np.sqrt(contact.area_m2), LEAST)
