"""The specimen on the arm: block, plate with its foam border, and the friction between block and plate.

All numbers are in SI units and radians. The plate frame has its origin at the plate's centre on its surface, z up when
level. The defaults are the paper's rig (sections III and IV, Figs. 2 and 4) as far as it states them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from station.rig.opening import Opening

FixedIn = Literal["object", "plate"]
STEEPEST_RAD = 1.3
"""No friction angle is drawn above this (74°): beyond it the tangent says nothing about a contact."""


@dataclass(frozen=True, kw_only=True)
class Block:
    """A cube that lies on the plate; the default mass is that of solid steel."""

    side_m: float = 0.01
    mass_kg: float = 0.00785

    def __post_init__(self) -> None:
        """Refuses, by a ValueError, numbers that no block can have."""
        _positive(self, "side_m", "mass_kg")


@dataclass(frozen=True, kw_only=True)
class Plate:
    """The square plate, the foam border with its cutout, and the camera's mount above it.

    The cutout is a circle, or has the corners `cutout_outline_m` (x, y).

    The foam is a spring and a damper: `foam_stiffness_n_m` per touching corner, `foam_damping` as a share of critical
    damping (near 1: the block hardly rebounds), `foam_mu` its friction against the block's side. `fiducials_m` are
    the centres of the marks fixed to the plate, in the plate frame.
    """

    side_m: float = 0.1
    thickness_m: float = 0.005
    mass_kg: float = 0.15
    cutout_radius_m: float = 0.045
    cutout_outline_m: tuple[tuple[float, float], ...] = ()
    foam_height_m: float = 0.01
    foam_stiffness_n_m: float = 60.0
    foam_damping: float = 0.8
    foam_mu: float = 0.6
    camera_height_m: float = 0.16
    camera_mass_kg: float = 0.03
    fiducials_m: tuple[tuple[float, float], ...] = ((0.0, 0.0475), (0.0475, 0.0), (0.0, -0.0475), (-0.0475, 0.0))

    def __post_init__(self) -> None:
        """Refuses, by a ValueError, numbers that no plate can have."""
        _positive(self, "side_m", "thickness_m", "mass_kg", "cutout_radius_m", "foam_height_m", "foam_stiffness_n_m")
        _positive(self, "foam_damping", "foam_mu", "camera_height_m", "camera_mass_kg")
        if not self.cutout_outline_m and self.cutout_radius_m > self.side_m / 2:
            raise ValueError(f"the cutout ({self.cutout_radius_m} m) is wider than the plate ({self.side_m} m)")

    @property
    def opening(self) -> Opening:
        """The opening in the foam."""
        return Opening(radius_m=self.cutout_radius_m, outline_m=self.cutout_outline_m)


@dataclass(frozen=True, kw_only=True)
class Friction:
    """Friction of one material pair: static mean, scatter from run to run, and the limit curve.

    The limit curve is an ellipse with the geometric mean tan(angle). `ratio` is mu along its axis over mu across it
    (1: isotropic); the axis stands at `axis_rad` from x in the frame of the object or of the plate. `scatter` is the
    standard deviation of the ANGLE relative to `mean_angle_rad`; each new contact draws one angle.
    """

    mean_angle_rad: float
    scatter: float = 0.0
    ratio: float = 1.0
    axis_rad: float = 0.0
    fixed_in: FixedIn = "object"
    object: str = ""
    plate: str = ""
    note: str = ""

    def __post_init__(self) -> None:
        """Refuses, by a ValueError, numbers that no friction can have."""
        if not 0 < self.mean_angle_rad < STEEPEST_RAD:
            raise ValueError(f"mean_angle_rad must lie between 0 and {STEEPEST_RAD}, got {self.mean_angle_rad}")
        if not 0 <= self.scatter < 1:
            raise ValueError(f"scatter must be a share from 0 to below 1, got {self.scatter}")
        _positive(self, "ratio")

    @property
    def isotropic(self) -> bool:
        """True if the limit curve is a circle."""
        return self.ratio == 1.0

    def draw(self, rng: np.random.Generator) -> FrictionDraw:
        """Draws one contact's friction."""
        angle = self.mean_angle_rad * (1 + self.scatter * float(rng.standard_normal()))
        return self.at(min(max(angle, 0.05 * self.mean_angle_rad), STEEPEST_RAD))

    def at(self, angle_rad: float) -> FrictionDraw:
        """Returns the limit curve whose geometric mean is tan(`angle_rad`)."""
        mu, stretch = math.tan(angle_rad), math.sqrt(self.ratio)
        return FrictionDraw(angle_rad=angle_rad, mu=mu, mu_along=mu * stretch, mu_across=mu / stretch)


@dataclass(frozen=True, kw_only=True)
class FrictionDraw:
    """The friction of one contact: its angle, the geometric mean mu, and mu along and across the ellipse's axis."""

    angle_rad: float
    mu: float
    mu_along: float
    mu_across: float


def _positive(value: object, *names: str) -> None:
    for name in names:
        number = getattr(value, name)
        if not (math.isfinite(number) and number > 0):
            raise ValueError(f"{name} must be a positive number, got {number}")
