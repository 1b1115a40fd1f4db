"""Artefact of the cone: a simulator with a pyramid for the friction cone makes friction depend on the direction.

m = (1 − a) + a q(φ), φ the way in the frame's axes: a curve between the circle (a = 0) and the square with its corners
on the axes (a = 1). The square's support function max(|cos φ|, |sin φ|) has a kink at 45°, which nothing that follows
the way of a slide can pass in finite steps: q is its mean over φ ± 0.05 rad, which keeps it convex (a mean of turned
squares) and holds 0.72 instead of 0.71 of the force at 45°.
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from station.physics.circle import cos_sin
from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter

ROUNDED_RAD = 0.05
_COS, _SIN = math.cos(ROUNDED_RAD), math.sin(ROUNDED_RAD)
_NEAR = math.sqrt(2.0) * _SIN
"""|cos| and |sin| differ by less than this where φ ± ROUNDED_RAD contains a corner; the mean then has both sides."""
_OF_LARGER = _SIN / ROUNDED_RAD
_AT_CORNER, _OF_SUM = math.sqrt(2.0) / (2.0 * ROUNDED_RAD), (_COS - _SIN) / (2.0 * ROUNDED_RAD)


class ConeArtifact(Effect):
    """A pyramidal cone gives a false four-fold anisotropy."""

    id: ClassVar[str] = "cone_artifact"
    title: ClassVar[str] = "artefact of a pyramidal cone"
    law: ClassVar[str] = "friction (1 - a) + a max(|cos|, |sin|) of the way (a = 0)"
    source: ClassVar[str] = "Stewart & Trinkle 1996, Int. J. Numer. Methods Eng. 39, 2673 (polyhedral cones)"
    layer: ClassVar[Layer] = "numerics"
    family: ClassVar[Family] = "numerics"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(name="share", symbol="a", unit="1", low=0.0, high=1.0, typical=0.3),
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("plate_anisotropy",)
    separated_by: ClassVar[str] = "the simulation again with an elliptic cone, and tilts at 22.5° and 45°"

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """Gives the factor (n,) on friction by the law of this module."""
        cosine, sine = cos_sin(contact.way_rad)
        along, across = np.abs(cosine), np.abs(sine)
        larger, smaller = np.maximum(along, across), np.minimum(along, across)
        corner = larger - smaller < _NEAR
        square = np.where(corner, _AT_CORNER - _OF_SUM * (larger + smaller), _OF_LARGER * larger)
        return 1.0 - values["share"] * (1.0 - square)
