"""Uneven contact: friction differs over the sole (a worn corner, dust, three points that carry), and the block turns.

Friction's resultant acts at a = (ax, ay) from the point under the mass, in the block's frame, turned by its yaw. With e
the way and F = −f e the friction per mass:

- in the slide its moment a × F turns the block, k² ω′ = −f a × e, k² = A / 6 a square's radius of gyration: the
  simulator takes the arm −a × e and its own f (`lever`), and what resists the turning (`sole`);
- at rest the moment takes its share of the limit surface |F|² + M² / (ρ² + a²) = (mu N)², so that
  h² = mu² (1 − (a × e)² / (ρ² + a²)), ρ² = A / 12.

Where friction grows linearly over a flat square sole by g per metre, a = g A / 12. With
tests/unit/physics/test_contact_points.py, a block on many points, both agree to 2 % of the turn. The pressure under a
tall block leads (see `com_offset`), and meets other friction in front: a cube's turn is 10 to 30 % larger, and its
friction differs by 12 (mu / 2) (a · e) / √A between one way and the opposite one, which this law leaves out.

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
from station.physics.sole import TURNING_RADIUS


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
        Parameter(name="x_m", unit="m", low=-5e-3, high=5e-3, typical=5e-4),
        Parameter(name="y_m", unit="m", low=-5e-3, high=5e-3, typical=5e-4),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("object_anisotropy", "one_way_friction")
    separated_by: ClassVar[str] = (
        "the yaw rate against the speed of sliding, with the block turned by 180° between runs"
    )
    demonstrated: ClassVar[Values] = {"x_m": 0.0015}

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """Gives the factor (n,) on friction by the law of this module."""
        if contact.moving.all():
            return 1.0
        square = values["x_m"] ** 2 + values["y_m"] ** 2
        reach = TURNING_RADIUS**2 * contact.area_m2 + square
        return np.where(contact.moving, 1.0, np.sqrt(1.0 - _across_m(contact, values) ** 2 / reach))

    def lever(self, contact: Contact, values: Values) -> Array | float:
        """Gives the lever (n,), m, of the friction by the law of this module."""
        arm = -_across_m(contact, values)
        return arm if contact.moving.all() else np.where(contact.moving, arm, 0.0)


def _across_m(contact: Contact, values: Values) -> Array:
    """The arm's part across the way, a × e (n,)."""
    cosine, sine = cos_sin(contact.way_rad - contact.yaw_rad)
    return values["x_m"] * sine - values["y_m"] * cosine
