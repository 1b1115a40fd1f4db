"""Patches: friction depends on the place on the plate.

ln m is a Fourier series of the place of the first order, with a length of its own: with u = x / L and v = y / L in the
plate's own grain, A = 1 − cos u and B = 1 − cos v,

    a sin u + b sin v + c (A + B) + d (A − B) + t sin u sin v + p B sin u + q A sin v + s A B,

all that sines and cosines of u and v span together but for the level, which is mu_s. Where L is long beside the paths
it is a slope across the plate (a, b), a bowl (c), a saddle (d, t); where it is short, waves, or a spot at any place.
The logarithm keeps friction positive. Of several spots it shows the strongest, and what is left is located as `other`.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter

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
        u, v = _place(contact, values["length_m"])
        sin_u, sin_v, low_u, low_v = np.sin(u), np.sin(v), 1.0 - np.cos(u), 1.0 - np.cos(v)
        terms = (
            *(sin_u, sin_v, low_u + low_v, low_u - low_v, sin_u * sin_v),
            *(sin_u * low_v, low_u * sin_v, low_u * low_v),
        )
        sizes = (values[name] for name in SIZES)
        return np.exp(sum((size * term for size, term in zip(sizes, terms, strict=True)), np.zeros(len(contact))))


def _place(contact: Contact, length_m: float) -> tuple[Array, Array]:
    """The place over the length, in the plate's grain: u and v (n,)."""
    cos, sin = np.cos(contact.mount_rad), np.sin(contact.mount_rad)
    u = (cos * contact.x_m + sin * contact.y_m) / length_m
    v = (cos * contact.y_m - sin * contact.x_m) / length_m
    return u, v
