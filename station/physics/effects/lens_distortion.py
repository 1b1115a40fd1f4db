"""Lens distortion: places seem too far out or in, the more so the farther they are from the image's centre.

Displacement k1 ρ² (p − c), c where the optical axis meets the plate and ρ = |p − c| over half the image's height, so
that k1 is the relative error at the image's upper and lower edge: k1 > 0 moves places outwards (pincushion).
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, View
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter

FARTHEST = 2.0
"""Distortion is not followed beyond this many half images."""


class LensDistortion(Effect):
    """The calibration misses a radial distortion."""

    id: ClassVar[str] = "lens_distortion"
    title: ClassVar[str] = "radial distortion of the lens"
    law: ClassVar[str] = "displacement k1 rho² (p - c), rho over half the image (k1 = 0)"
    source: ClassVar[str] = "Brown 1971, Photogrammetric Engineering 37, 855"
    layer: ClassVar[Layer] = "camera"
    family: ClassVar[Family] = "image"
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter(name="k1", unit="1", low=-0.2, high=0.2, typical=0.02),)
    confounded_with: ClassVar[tuple[str, ...]] = ("friction_patch", "rate_strengthening")
    separated_by: ClassVar[str] = "a calibration with a board that fills the image, or mirrored starts"

    def seen(self, view: View, values: Values) -> Array | None:
        """Gives the displacement (n, 4, 2), m, of the corners' images by the law of this module."""
        from_axis = view.point_m - view.image_centre_m
        rho = np.linalg.norm(from_axis, axis=-1, keepdims=True) / (view.image_size_m / 2)
        return values["k1"] * np.minimum(rho, FARTHEST) ** 2 * from_axis
