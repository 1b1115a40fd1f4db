"""Artefact of the cone: a simulator with a pyramid for the friction cone makes friction depend on the direction.

m = (1 − a) + a max(|cos φ|, |sin φ|), φ the way in the frame's axes: the support function of a curve between the circle
(a = 0) and the square with its corners on the axes (a = 1), which holds 1/√2 of the force at 45°.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter


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
        facing = np.maximum(np.abs(np.cos(contact.way_rad)), np.abs(np.sin(contact.way_rad)))
        return 1.0 - values["share"] * (1.0 - facing)
