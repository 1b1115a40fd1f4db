"""An ellipse for the limit curve where the block slides: MuJoCo knows no other shape.

A limit curve with the support function h(φ) is met at one direction by the ellipse h² = eᵀ A e that shares value,
slope and bend there: with H = h², A's mean is H + H″/4 and its second harmonic follows from H″ and H′. It exists
exactly where the curve is convex (h + h″ > 0), and force, direction and the turning of a slow block are the curve's.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from station.physics.contact import Array
from station.simulators.planar.friction import Support

_FLATTEST = 1e-3
"""The smallest curvature h + h″, relative to h: a facet of the curve would be an ellipse without width."""


class Ellipse(NamedTuple):
    """Friction along and across an axis at an angle (a,) from x."""

    along: Array
    across: Array
    axis_rad: Array


def osculating(curve: Support, way_rad: Array) -> Ellipse:
    """Returns the ellipses that touch a limit curve in the directions `way_rad` (a,), rad in P."""
    h = np.maximum(curve.value, 1e-9)
    if np.ndim(curve.slope) == 0 and not curve.slope and not np.any(curve.bend):
        return Ellipse(h, h, np.zeros_like(h))
    bend = np.maximum(curve.bend, (_FLATTEST - 1.0) * h)
    slope = np.broadcast_to(curve.slope, h.shape)
    square, second = h * h, 2.0 * (slope * slope + h * bend)
    mean = square + 0.25 * second
    along, aside = -0.25 * second, h * slope
    size = np.minimum(np.hypot(along, aside), mean * (1.0 - 1e-9))
    axis = way_rad + 0.5 * np.arctan2(aside, along)
    return Ellipse(np.sqrt(mean + size), np.sqrt(mean - size), axis)
