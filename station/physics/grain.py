"""Friction with two easy and two hard directions: the limit curve of a grain, an ellipse or pinched, always convex.

With q the shape, r = hypot(c, s) and w = c cos 2ψ + s sin 2ψ,

    m(ψ) = (cosh q r + (sinh q r / r) w)^(1 / 2q)

is the support function of a curve whose extremes are exp(± r / 2), so that their ratio is exp(r) and mu_s their
geometric mean; the larger one is at ψ = atan2(s, c) / 2. q = 1 is the ellipse (Goyal, Ruina, Papadopoulos 1991). q = ½
is 1 + a cos 2ψ in the direction of sliding (Zmitrowicz 2006); q = 5/2 is, to second order in r, the curve whose radius,
the force that is held, is 1 + a cos 2ψ. Real curves lie between.
"""

from __future__ import annotations

import math

import numpy as np

from station.physics.contact import Array
from station.physics.effect import Values
from station.physics.parameter import Parameter

STEEPEST = 1.7
"""The largest q r of a convex curve with q > 1: tanh² q r ≤ 2 q² / ((q + 1) (2 q − 1)) is at least 0.89 there."""

PARAMETERS = (
    Parameter(name="cos2", unit="1", low=-0.7, high=0.7, typical=0.1),
    Parameter(name="sin2", unit="1", low=-0.7, high=0.7, typical=0.1),
    Parameter(name="shape", unit="1", low=0.5, high=3.0, typical=0.5, null=None, starts=(1.0,)),
)
"""Those of every effect of a grain."""


def grain(angle_rad: Array, values: Values) -> Array:
    """The factor m (n,) on friction for slides at angles (n,) from the grain's own axis."""
    size = math.hypot(values["cos2"], values["sin2"])
    shape = _convex(values["shape"], size)
    wave = values["cos2"] * np.cos(2.0 * angle_rad) + values["sin2"] * np.sin(2.0 * angle_rad)
    slope = math.sinh(shape * size) / size if size > 0.0 else shape
    return (math.cosh(shape * size) + slope * wave) ** (0.5 / shape)


def _convex(shape: float, size: float) -> float:
    """The nearest shape for which a grain of this size is convex; an ellipse always is.

    For q < 1 the curve bends in where tanh q r > q / (2 − q); q ≥ 1.25 r − 0.35 keeps it from that for all r < 1.
    """
    return min(max(shape, 1.25 * size - 0.35), max(STEEPEST / size, 1.0)) if size > 0.0 else shape
