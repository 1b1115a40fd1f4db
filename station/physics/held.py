"""The support function of a limit curve, which a slide meets, from the force that the curve holds in each direction.

A curve is often known by its radius r(ψ), the force that is held against a pull at ψ. A slide in φ meets h(φ) = max
over ψ of r(ψ) cos(φ − ψ) (maximum dissipation; Goyal, Ruina, Papadopoulos 1991).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Protocol

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from station.physics.contact import Array
from station.physics.narrowing import Bracket

NEARLY_FLAT = 0.95
"""The largest share of a shape that a convex curve can bear; beyond 1 a side would bend in."""

NODES = 513
"""The nodes of a support function's table: cubics between them err by 1e-10, and by 1e-6 beside a nearly flat side."""

_STEPS = 40
_SETTLED_RAD = 1e-9
_FARTHEST_RAD = 1.5


class Held(Protocol):
    """A convex curve around the origin by its radius, symmetric about an axis; equal curves have equal hashes."""

    @property
    def folds(self) -> int:
        """The number of its repetitions in a full turn."""
        ...

    def radius(self, angle_rad: Array) -> Array:
        """Returns r (n,) at `angle_rad` (n,), rad, from its axis."""
        ...

    def slopes(self, angle_rad: Array) -> tuple[Array, Array]:
        """Returns d ln r / dψ and d² ln r / dψ² (n,) at ψ, `angle_rad` (n,), rad, from its axis."""
        ...

    def __hash__(self) -> int: ...


def support_of(held: Held, angle_rad: Array) -> Array:
    """Returns the support function h (n,) for slides at angles φ, `angle_rad` (n,), rad, from the curve's axis."""
    period = 2.0 * np.pi / held.folds
    return _table(held)(np.abs(angle_rad - period * np.round(angle_rad / period)))


@lru_cache(maxsize=64)
def _table(held: Held) -> CubicHermiteSpline:
    """Returns the support function as a spline, from the axis to half its period, where it is mirrored."""
    angle = np.linspace(0.0, np.pi / held.folds, NODES)
    off = _off(held, angle)
    radius = held.radius(angle + off)
    return CubicHermiteSpline(angle, radius * np.cos(off), radius * np.sin(off))


def _off(held: Held, angle_rad: Array) -> Array:
    """Returns the offset ψ − φ (n,) of the largest r(ψ) cos(φ − ψ), by Newton's method in a bracket."""
    bracket = Bracket.around(len(angle_rad), _FARTHEST_RAD)
    for _ in range(_STEPS):
        tangent = np.tan(bracket.at)
        slope, bend = held.slopes(angle_rad + bracket.at)
        bracket = bracket.narrowed(tangent - slope, 1.0 + tangent**2 - bend)
        if bracket.settled(_SETTLED_RAD):
            break
    return bracket.at
