"""Patches: friction depends on the place on the plate.

ln m is a Fourier series of the place of the first order, with a length of its own: with u = x / L and v = y / L in the
plate's own grain, A = 1 − cos u and B = 1 − cos v,

    a sin u + b sin v + c (A + B) + d (A − B) + t sin u sin v + p B sin u + q A sin v + s A B,

all that sines and cosines of u and v span together but for the level, which is mu_s. Where L is long beside the paths
it is a slope across the plate (a, b), a bowl (c), a saddle (d, t); where it is short, waves, or a spot at any place.
The logarithm keeps friction positive. Of several spots it shows the strongest, and what is left is located as `other`.

A block that slides along the border of a patch has more friction under one side, and turns. To the first order friction
acts at a = n ∇ln m A / 12 from the point under the mass (see `uneven_contact`): n is 1 where the whole of a square sole
carries, 0 where a block stands on its middle, and 3 where it stands on its corners, whose square distance from the
middle is three times the mean. At rest the moment takes its share of the friction, as there.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter
from station.physics.sole import left_beside_moment

SECOND_MOMENT = 1.0 / 12.0
"""The mean square distance of a unit square's points from its middle line."""

SIZES = ("slope_x", "slope_y", "bowl", "saddle", "twist", "ridge_x", "ridge_y", "spot")


class FrictionPatch(Effect):
    """Friction depends on the place."""

    id: ClassVar[str] = "friction_patch"
    title: ClassVar[str] = "friction by place"
    law: ClassVar[str] = "ln mu is a first-order Fourier series of the place over a length of its own (all terms 0)"
    source: ClassVar[str] = (
        "Dressel et al., figure 8 (maps of the angle by place); Yu et al. 2016, IROS (pushing data set: 5 % sd)"
    )
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "place"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        *(Parameter(name=name, unit="1", low=-0.5, high=0.5, typical=0.05) for name in SIZES),
        Parameter(
            name="length_m", unit="m", low=0.005, high=0.04, typical=0.01, null=None, starts=(0.014, 0.008, 0.03)
        ),
        Parameter(name="turning", unit="1", low=0.0, high=3.0, typical=0.5, null=None, starts=(1.0,)),
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
        """Gives the factor (n,) on friction by the law of this module."""
        factor = self.unturned(contact, values)
        if values["turning"] == 0.0 or contact.moving.all():
            return factor
        along_u, along_v = _arm_m(contact, values)
        left = left_beside_moment(_across(contact, along_u, along_v), along_u**2 + along_v**2, contact.area_m2)
        return np.where(contact.moving, factor, factor * left)

    def unturned(self, contact: Contact, values: Values) -> Array | float:
        """Gives the factor (n,) on friction beside which the moment acts: that of the place."""
        u, v = _place(contact, values["length_m"])
        sin_u, sin_v, low_u, low_v = np.sin(u), np.sin(v), 1.0 - np.cos(u), 1.0 - np.cos(v)
        terms = (
            *(sin_u, sin_v, low_u + low_v, low_u - low_v, sin_u * sin_v),
            *(sin_u * low_v, low_u * sin_v, low_u * low_v),
        )
        return np.exp(_weighed(values, terms))

    def lever(self, contact: Contact, values: Values) -> Array | float:
        """Gives the lever (n,), m, of the friction by the law of this module."""
        if values["turning"] == 0.0 or not contact.moving.any():
            return 0.0
        return np.where(contact.moving, -_across(contact, *_arm_m(contact, values)), 0.0)


def _across(contact: Contact, along_u: Array, along_v: Array) -> Array:
    """Returns the part a × e (n,) across the way of an arm a in the plate's grain."""
    way_rad = contact.way_rad - contact.mount_rad
    return along_u * np.sin(way_rad) - along_v * np.cos(way_rad)


def _arm_m(contact: Contact, values: Values) -> tuple[Array, Array]:
    """Returns friction's arm a (n,), m, along the two axes of the plate's grain."""
    u, v = _place(contact, values["length_m"])
    sin_u, sin_v, cos_u, cos_v, zero = np.sin(u), np.sin(v), np.cos(u), np.cos(v), np.zeros(len(contact))
    low_u, low_v, both = 1.0 - cos_u, 1.0 - cos_v, sin_u * sin_v
    by_u = (cos_u, zero, sin_u, sin_u, cos_u * sin_v, cos_u * low_v, both, sin_u * low_v)
    by_v = (zero, cos_v, sin_v, -sin_v, sin_u * cos_v, both, low_u * cos_v, low_u * sin_v)
    reach = values["turning"] * SECOND_MOMENT * contact.area_m2 / values["length_m"]
    return reach * _weighed(values, by_u), reach * _weighed(values, by_v)


def _weighed(values: Values, terms: Sequence[Array]) -> Array:
    """Returns the sum (n,) of the terms (n,), each by its size."""
    return np.array([values[name] for name in SIZES]) @ np.array(terms)


def _place(contact: Contact, length_m: float) -> tuple[Array, Array]:
    """Returns the place over the length, in the plate's grain: u and v (n,)."""
    cos, sin = np.cos(contact.mount_rad), np.sin(contact.mount_rad)
    u = (cos * contact.x_m + sin * contact.y_m) / length_m
    v = (cos * contact.y_m - sin * contact.x_m) / length_m
    return u, v
