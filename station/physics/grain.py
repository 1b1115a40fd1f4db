"""Friction with two easy and two hard directions: the limit curve of a grain, an ellipse or pinched, always convex.

With p the shape, s = hypot(c2, s2) and w = c2 cos 2ψ + s2 sin 2ψ, the force that is held against a pull at ψ is

    r(ψ) = (cosh p s + (sinh p s / s) w)^(1 / 2p):

its extremes are exp(± s / 2), so that their ratio is exp(s) and mu_s their geometric mean; the larger one is at
ψ = atan2(s2, c2) / 2. p = −1 is the ellipse (Goyal, Ruina, Papadopoulos 1991); p = ½ is 1 + a cos 2ψ, as a direction's
friction is often tabulated; p = −3/2 is, to second order, 1 + a cos 2φ in the direction of sliding (Zmitrowicz 2006).
What slides in φ meets the curve's support function (held.py).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from station.physics.circle import cos_sin
from station.physics.contact import Array
from station.physics.effect import Values
from station.physics.held import NEARLY_FLAT, support_of
from station.physics.parameter import Parameter

ELLIPSE = -1.0
"""The shape whose support function is known in closed form."""

PARAMETERS = (
    Parameter(name="cos2", unit="1", low=-0.7, high=0.7, typical=0.1),
    Parameter(name="sin2", unit="1", low=-0.7, high=0.7, typical=0.1),
    Parameter(name="shape", unit="1", low=-1.5, high=1.0, typical=0.5, null=None, starts=(ELLIPSE,)),
)
"""The parameters of every effect of a grain."""


def grain(angle_rad: Array, values: Values) -> Array:
    """Gives the factor h (n,) on friction for slides at angles φ, `angle_rad` (n,), rad, from the grain's own axis."""
    size = math.hypot(values["cos2"], values["sin2"])
    from_axis = angle_rad - 0.5 * math.atan2(values["sin2"], values["cos2"])
    if values["shape"] == ELLIPSE:
        return np.sqrt(math.cosh(size) + math.sinh(size) * np.cos(2.0 * from_axis))
    return support_of(_Grain(size, _convex(values["shape"], size)), from_axis)


@dataclass(frozen=True, slots=True)
class _Grain:
    """The limit curve by its radius, with angles counted from its larger extreme."""

    size: float
    shape: float
    folds: int = 2

    def radius(self, angle_rad: Array) -> Array:
        """Returns r (n,) at angles (n,)."""
        wave = np.cos(2.0 * angle_rad)
        if abs(self.shape) <= _FLAT:
            return np.exp(0.5 * self.size * wave)
        return (math.cosh(self.shape * self.size) + math.sinh(self.shape * self.size) * wave) ** (0.5 / self.shape)

    def slopes(self, angle_rad: Array) -> tuple[Array, Array]:
        """Returns d ln r / dψ and d² ln r / dψ² (n,)."""
        wave, across = cos_sin(2.0 * angle_rad)
        even, odd = math.cosh(self.shape * self.size), math.sinh(self.shape * self.size)
        over_shape = odd / self.shape if abs(self.shape) > _FLAT else self.size
        base = even + odd * wave
        return -over_shape * across / base, -2.0 * over_shape * (even * wave + odd) / base**2


_FLAT = 1e-6
"""A smaller |p| counts as 0, where r = exp(w / 2)."""


def _convex(shape: float, size: float) -> float:
    """Returns the nearest shape for which a grain of this size is convex; an ellipse always is."""
    if NEARLY_FLAT * _largest(shape) >= size:
        return shape

    def room(other: float) -> float:
        return NEARLY_FLAT * _largest(other) - size

    root: Any = brentq(room, ELLIPSE, shape, xtol=1e-9)
    return float(root)


def _largest(shape: float) -> float:
    """Returns the largest size of a convex curve.

    It is artanh(p / (2 + p)) / p, from 1 + (ln r)′² − (ln r)″ ≥ 0 at the waist.
    """
    if shape <= ELLIPSE + _FLAT:
        return _ANY
    return 0.5 if abs(shape) <= _FLAT else math.atanh(shape / (2.0 + shape)) / shape


_ANY = 8.0
"""A size larger than any within the bounds."""
