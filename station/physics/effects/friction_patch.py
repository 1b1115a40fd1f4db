"""Patches: friction depends on the place on the plate.

ln m is a Fourier series of the place of the second order, with a length of its own: with u = x / L and v = y / L in the
plate's own grain, A = 1 − cos u and B = 1 − cos v, its first order is

    a sin u + b sin v + c (A + B) + d (A − B) + t sin u sin v + p B sin u + q A sin v + s A B,

all that sines and cosines of u and v span together but for the level, which is mu_s. Where L is long beside the paths
it is a slope across the plate (a, b), a bowl (c), a saddle (d, t); where it is short, waves, or a spot at any place.
The second order adds the sines and cosines of 2u and 2v, each `finer` number times the rms of the first order's eight.
These numbers have a prior: one plate's friction is smooth, so that what is twice as fine is less. The logarithm keeps
friction positive. Of several spots it shows the strongest, and what is left is located as `other`.

A block that slides along the border of a patch has more friction under one side, and turns. To the first order friction
acts at a = n ∇ln m A / 12 from the point under the mass (see `uneven_contact`): n is 1 where the whole of a square sole
carries, 0 where a block stands on its middle, and 3 where it stands on its corners, whose square distance from the
middle is three times the mean. At rest the moment takes its share of the friction, as there. The pressure under a tall
block leads its mass by `lead` widths of the sole, and the friction is that of the place where the pressure is. All of
it opposes the motion: the lead steers no block.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from station.physics.contact import Array, Contact
from station.physics.effect import Effect, Family, Layer, Values
from station.physics.parameter import Parameter
from station.physics.sole import left_beside_moment

NINE_TENTHS = (0.05, 0.95)
"""The quantiles between which nine tenths of the places lie."""

SECOND_MOMENT = 1.0 / 12.0
"""The mean square distance of a unit square's points from its middle line."""

WAVES = ("flat", "sin", "bow", "sin2", "bow2")
"""The factors of each coordinate: 1, sin u, 1 − cos u, sin 2u and 1 − cos 2u."""


def _sizes_of(terms: Sequence[Sequence[tuple[int, int, float]]]) -> Array:
    """Returns the sizes (m, 25) of all products of a factor of u and one of v in m terms."""
    found = np.zeros((len(terms), len(WAVES), len(WAVES)))
    for sizes, term in zip(found, terms, strict=True):
        for j, k, sign in term:
            sizes[j, k] = sign
    return found.reshape(len(terms), -1)


FIRST = {
    "slope_x": ((1, 0, 1.0),),
    "slope_y": ((0, 1, 1.0),),
    "bowl": ((2, 0, 1.0), (0, 2, 1.0)),
    "saddle": ((2, 0, 1.0), (0, 2, -1.0)),
    "twist": ((1, 1, 1.0),),
    "ridge_x": ((1, 2, 1.0),),
    "ridge_y": ((2, 1, 1.0),),
    "spot": ((2, 2, 1.0),),
}
"""The terms of the first order: the numbers of their factors of u and of v, and their signs."""

FINER = {f"finer_{WAVES[j]}_{WAVES[k]}": (j, k) for j in range(5) for k in range(5) if max(j, k) > 2}
"""The terms of the second order: the numbers of their factors of u and of v."""

FIRST_SIZES, FINER_SIZES = _sizes_of([*FIRST.values()]), _sizes_of([((j, k, 1.0),) for j, k in FINER.values()])
"""The sizes of the products of a factor of u and one of v in each term, (8, 25) and (16, 25)."""

FINER_SD = 0.4
"""The sd of the second order's numbers, which are shares of the rms of the first. Random fields of 8 per cent with
correlation lengths from 10 to 30 mm are likeliest with 0.5, one to four spots with radii from 6 to 14 mm with 0.3; with
0.1 a plate is 15 to 36 nats less likely, with 2 11 to 17 (`pytest -s tests/unit/physics/test_friction_patch.py`)."""


class FrictionPatch(Effect):
    """Friction depends on the place."""

    id: ClassVar[str] = "friction_patch"
    title: ClassVar[str] = "friction by place"
    law: ClassVar[str] = "ln mu is a second-order Fourier series of the place over a length of its own (all terms 0)"
    source: ClassVar[str] = (
        "Dressel et al., figure 8 (maps of the angle by place); Yu et al. 2016, IROS (pushing data set: 5 % sd)"
    )
    layer: ClassVar[Layer] = "contact"
    family: ClassVar[Family] = "place"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        *(Parameter(name=name, unit="1", low=-0.5, high=0.5, typical=0.05) for name in FIRST),
        Parameter(
            name="length_m", unit="m", low=0.005, high=0.04, typical=0.01, null=None, starts=(0.014, 0.008, 0.03)
        ),
        Parameter(name="turning", unit="1", low=0.0, high=3.0, typical=0.5, null=None, starts=(1.0,)),
        Parameter(name="lead", unit="1", low=0.0, high=0.5, typical=0.2, null=None, starts=(0.0,)),
        *(
            Parameter(name=name, unit="1", low=-3.0, high=3.0, typical=FINER_SD, null=None, starts=(0.0,), sd=FINER_SD)
            for name in FINER
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
        return self.unturned(contact, values) * _left(contact, values)

    def steering(self, contact: Contact, values: Values) -> Array | float:
        """Gives the factor (n,) on the curve that steers: a block at rest gives way to the moment."""
        return self.friction(contact, {**values, "lead": 0.0})

    def unturned(self, contact: Contact, values: Values) -> Array | float:
        """Gives the factor (n,) on friction beside which the moment acts: that of the place."""
        u, v = _place(contact, values)
        return np.exp(_sum(_waves(u), _sizes(values), _waves(v)))

    def lever(self, contact: Contact, values: Values) -> Array | float:
        """Gives the lever (n,), m, of the friction by the law of this module."""
        if values["turning"] == 0.0 or not contact.moving.any():
            return 0.0
        return np.where(contact.moving, -_across(contact, *_arm_m(contact, values)), 0.0)

    def derived(self, contact: Contact, values: Values) -> Mapping[str, tuple[float, str]]:
        """Returns how far friction differs between the places of these states, which the terms share."""
        friction = np.asarray(self.unturned(contact, values))
        friction = friction / friction.mean()
        low, high = np.quantile(friction, NINE_TENTHS).tolist()
        return {
            "spread of friction over the places slid over": (float(np.std(friction)), "1"),
            "least of it (5 %), of the mean": (low, "1"),
            "most of it (95 %), of the mean": (high, "1"),
        }


def _left(contact: Contact, values: Values) -> Array | float:
    """Returns the share (n,) of its friction that holds a block at rest beside the moment."""
    if values["turning"] == 0.0 or contact.moving.all():
        return 1.0
    along_u, along_v = _arm_m(contact, values)
    left = left_beside_moment(_across(contact, along_u, along_v), along_u**2 + along_v**2, contact.area_m2)
    return np.where(contact.moving, 1.0, left)


def _across(contact: Contact, along_u: Array, along_v: Array) -> Array:
    """Returns the part a × e (n,) across the way of an arm a in the plate's grain."""
    way_rad = contact.way_rad - contact.mount_rad
    return along_u * np.sin(way_rad) - along_v * np.cos(way_rad)


def _arm_m(contact: Contact, values: Values) -> tuple[Array, Array]:
    """Returns friction's arm a (n,), m, along the two axes of the plate's grain."""
    (u, v), sizes = _place(contact, values), _sizes(values)
    by_u, by_v = _sum(_slopes(u), sizes, _waves(v)), _sum(_waves(u), sizes, _slopes(v))
    reach = values["turning"] * SECOND_MOMENT * contact.area_m2 / values["length_m"]
    return reach * by_u, reach * by_v


def _sum(along_u: Array, sizes: Array, along_v: Array) -> Array:
    """Returns the sum (n,) of the terms: their sizes (5, 5) times the factors of u and of v, (5, n) each."""
    return np.asarray((along_u * (sizes @ along_v)).sum(axis=0))


def _sizes(values: Values) -> Array:
    """Returns the sizes (5, 5) of all products of a factor of u and one of v."""
    first, finer = (np.array([values[name] for name in names]) for names in (FIRST, FINER))
    rms = np.sqrt(np.mean(np.square(first)))
    return (first @ FIRST_SIZES + rms * (finer @ FINER_SIZES)).reshape(len(WAVES), len(WAVES))


def _waves(u: Array) -> Array:
    """Returns the factors (5, n) of a coordinate (n,), which are 1 and 0 where it is 0."""
    sin, cos = np.sin(u), np.cos(u)
    return np.array([np.ones_like(u), sin, 1.0 - cos, 2.0 * sin * cos, 2.0 * sin * sin])


def _slopes(u: Array) -> Array:
    """Returns the derivatives (5, n) of the factors by the coordinate (n,)."""
    sin, cos = np.sin(u), np.cos(u)
    return np.array([np.zeros_like(u), cos, sin, 2.0 * (cos * cos - sin * sin), 4.0 * sin * cos])


def _place(contact: Contact, values: Values) -> tuple[Array, Array]:
    """Returns where the pressure is, over the length, in the plate's grain: u and v (n,)."""
    ahead_m = values["lead"] * np.sqrt(contact.area_m2)
    x_m, y_m = contact.x_m + ahead_m * contact.way[:, 0], contact.y_m + ahead_m * contact.way[:, 1]
    cos, sin = np.cos(contact.mount_rad), np.sin(contact.mount_rad)
    return (cos * x_m + sin * y_m) / values["length_m"], (cos * y_m - sin * x_m) / values["length_m"]
