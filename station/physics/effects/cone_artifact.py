"""Artefact of the cone: a simulator with a pyramid for the friction cone makes friction depend on the direction.

m = (1 − a) + a q(φ), φ the way in the frame's axes: a curve between the circle (a = 0) and the square with its corners
on the axes (a = 1). The square's support function max(|cos φ|, |sin φ|) has a kink at 45°, which nothing that follows
the way of a slide can pass in finite steps: q is its mean over φ ± 0.05 rad, which keeps it convex (a mean of turned
squares) and holds 0.72 instead of 0.71 of the force at 45°.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter

ROUNDED_RAD = 0.05


class ConeArtifact(Effect):
    """A pyramidal cone gives a false four-fold anisotropy."""

    id: ClassVar[str] = "cone_artifact"
    title: ClassVar[str] = "artefact of a pyramidal cone"
    law: ClassVar[str] = "friction (1 - a) + a max(|cos|, |sin|) of the way (a = 0)"
    source: ClassVar[str] = "Stewart & Trinkle 1996, Int. J. Numer. Methods Eng. 39, 2673 (polyhedral cones)"
    layer: ClassVar[Layer] = "numerics"
    family: ClassVar[Family] = "numerics"
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter(name="share", unit="1", low=0.0, high=1.0, typical=0.3),)
    confounded_with: ClassVar[tuple[str, ...]] = ("plate_anisotropy",)
    separated_by: ClassVar[str] = "the simulation again with an elliptic cone, and tilts at 22.5° and 45°"

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """See the module."""
        way = contact.way_rad
        square = (_integral(way + ROUNDED_RAD) - _integral(way - ROUNDED_RAD)) / (2.0 * ROUNDED_RAD)
        return 1.0 - values["share"] * (1.0 - square)


def _integral(way_rad: Array) -> Array:
    """Of max(|cos|, |sin|) from 0: √2 for every quarter."""
    quarter = np.round(way_rad / (np.pi / 2))
    return np.sqrt(2.0) * quarter + np.sin(way_rad - quarter * (np.pi / 2))
