"""From the force that a limit curve holds in each direction to the friction that a slide meets: its support function.

A curve is often known by its radius r(ψ), the force that is held against a pull at ψ. What slides in φ meets
h(φ) = max over ψ of r(ψ) cos(φ − ψ) (maximum dissipation; Goyal, Ruina, Papadopoulos 1991).
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from station.physics.contact import Array
from station.physics.narrowing import Bracket

NEARLY_FLAT = 0.98
"""The share of what a convex curve can bear of a shape: beyond it a side would bend in."""

_STEPS = 40
_SETTLED_RAD = 1e-9
_FARTHEST_RAD = 1.5


class Held(Protocol):
    """A convex curve around the origin by its radius."""

    def radius(self, angle_rad: Array) -> Array:
        """r (n,) at angles (n,)."""
        ...

    def slopes(self, angle_rad: Array) -> tuple[Array, Array]:
        """d ln r / dψ and d² ln r / dψ² (n,)."""
        ...


def support_of(held: Held, angle_rad: Array) -> Array:
    """h (n,) for slides at angles φ (n,): the largest r(φ + off) cos(off) over off, by Newton's method in a bracket."""
    bracket = Bracket.around(len(angle_rad), _FARTHEST_RAD)
    for _ in range(_STEPS):
        tangent = np.tan(bracket.at)
        slope, bend = held.slopes(angle_rad + bracket.at)
        bracket = bracket.narrowed(tangent - slope, 1.0 + tangent**2 - bend)
        if bracket.settled(_SETTLED_RAD):
            break
    return held.radius(angle_rad + bracket.at) * np.cos(bracket.at)
