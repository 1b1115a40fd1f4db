"""Patches: friction depends on the place on the plate.

m = exp(gx u + gy v + b (u² + v²) + p (u² − v²) + q 2uv), (u, v) the place over 40 mm in the plate's own grain: a slope
across the plate, a spot or ring about its centre (b) and a saddle (p, q). The logarithm keeps friction positive. A
small spot off the centre shows in these terms only in part: what is left of it is located as `other`.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter

RADIUS_M = 0.04
FARTHEST = 2.0
"""Places farther out than this many radii count as this far: a polynomial says nothing there."""


class FrictionPatch(Effect):
    """Friction depends on the place."""

    id: ClassVar[str] = "friction_patch"
    title: ClassVar[str] = "friction by place"
    law: ClassVar[str] = "ln mu is a second-degree polynomial of the place over 40 mm (all terms 0)"
    source: ClassVar[str] = (
        "Dressel et al., figure 8 (maps of the angle by place); Yu et al. 2016, IROS (pushing data set: 5 % sd)"
    )
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "place"
    parameters: ClassVar[tuple[Parameter, ...]] = tuple(
        Parameter(name=name, unit="1", low=-0.4, high=0.4, typical=0.05)
        for name in ("slope_x", "slope_y", "bowl", "saddle", "twist")
    )
    confounded_with: ClassVar[tuple[str, ...]] = (
        "platform_level",
        "one_way_friction",
        "lens_distortion",
        "border_contact",
    )
    is_series: ClassVar[bool] = True
    separated_by: ClassVar[str] = "the block put back to designed starts, so that place and direction are independent"

    def friction(self, contact: Contact, values: Values) -> Array | float:
        """See the module."""
        u, v = _place(contact)
        terms = {"slope_x": u, "slope_y": v, "bowl": u * u + v * v, "saddle": u * u - v * v, "twist": 2.0 * u * v}
        return np.exp(sum((values[name] * term for name, term in terms.items()), np.zeros(len(contact))))


def _place(contact: Contact) -> tuple[Array, Array]:
    """The place over the radius, in the plate's grain."""
    cos, sin = np.cos(contact.mount_rad), np.sin(contact.mount_rad)
    u = (cos * contact.x_m + sin * contact.y_m) / RADIUS_M
    v = (cos * contact.y_m - sin * contact.x_m) / RADIUS_M
    shrink = np.minimum(1.0, FARTHEST / np.maximum(np.hypot(u, v), 1e-12))
    return u * shrink, v * shrink
