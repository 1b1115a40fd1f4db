"""Bow: the plate is a little curved, so the slope under the block depends on the place.

Near its middle a smooth plate that is level there has the height z = ½ rᵀ K r over its tangent plane, with the place r
= (u, v) in the plate's own grain and K symmetric, as every surface's matrix of curvatures is (the first term of
Taylor's series; do Carmo 1976, Differential Geometry of Curves and Surfaces, section 3.3):

    K = [[b + s, t], [t, b - s]].

b > 0 is a bowl, b < 0 a dome; s and t are a saddle along the axes and along their diagonals. Its slope K r is linear in
the place. To first order in it, a block that rests flat on the plate at r feels gravity, with the tilt θ and the
descent d, as on a plate whose normal is (-K r, 1):

- along the plate it is pushed back to the middle by -g cos θ K r, as on any slope;
- it is pressed by g sin θ (d · K r) more, as where the bowl's far side faces the descent;
- sliding at v along e, it must follow the curve, and is pressed by v² (e · K e) more.

A sole of finite size touches a quadratic surface along parallel slopes: its chord has the slope of the middle, so its
size does not matter. A level error that is the same everywhere is `platform_level`; a push that turns about the middle
(an antisymmetric K) has no height, so that no plate's shape makes it.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import GRAVITY_M_S2, Array, Contact
from station.physics.effect import Effect, Family, Layer, Values, unit
from station.physics.parameter import Parameter


class PlateBow(Effect):
    """The plate is curved."""

    id: ClassVar[str] = "plate_bow"
    title: ClassVar[str] = "bow of the plate"
    law: ClassVar[str] = "slope K r at the place r, K = [[b + s, t], [t, b - s]] the plate's curvatures (0)"
    source: ClassVar[str] = "do Carmo 1976, Differential Geometry of Curves and Surfaces, section 3.3; gravity on a slope"
    layer: ClassVar[Layer] = "rig"
    family: ClassVar[Family] = "place"
    parameters: ClassVar[tuple[Parameter, ...]] = tuple(
        Parameter(name=name, unit="1/m", low=-2.0, high=2.0, typical=0.05)
        for name in ("bowl_per_m", "saddle_per_m", "twist_per_m")
    )
    confounded_with: ClassVar[tuple[str, ...]] = ("friction_patch", "platform_level", "border_contact")
    separated_by: ClassVar[str] = "the block put back to designed starts, or a straightedge laid across the plate"

    def push(self, contact: Contact, values: Values) -> Array | None:
        """Gives the force per mass (n, 3), m/s², by the law of this module."""
        curved = _curvatures(contact.mount_rad, values)
        slope = np.einsum("nij,nj->ni", curved, np.column_stack([contact.x_m, contact.y_m]))
        along = -GRAVITY_M_S2 * np.cos(contact.tilt_rad)[:, None] * slope
        pressed = GRAVITY_M_S2 * np.sin(contact.tilt_rad) * (slope * unit(contact.down_rad)).sum(axis=1)
        way = unit(contact.way_rad)
        followed = np.where(contact.moving, contact.speed_m_s**2, 0.0) * np.einsum("ni,nij,nj->n", way, curved, way)
        return np.column_stack([along, -pressed - followed])


def _curvatures(mount_rad: Array, values: Values) -> Array:
    """The matrices (n, 2, 2), 1/m, in P, of a plate that is turned in its mount."""
    bowl, saddle, twist = (values[name] for name in ("bowl_per_m", "saddle_per_m", "twist_per_m"))
    cos, sin = np.cos(2.0 * mount_rad), np.sin(2.0 * mount_rad)
    along, across = saddle * cos - twist * sin, saddle * sin + twist * cos
    rows = np.array([[bowl + along, across], [across, bowl - along]])
    return np.moveaxis(rows, 2, 0)
