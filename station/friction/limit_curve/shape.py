"""A limit curve: friction by the direction of the slide, against the object, against the plate, or both multiplied."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, cast

import numpy as np
from numpy.typing import ArrayLike

from station.friction.direction import Array
from station.friction.limit_curve.series import (
    ODD,
    ORDER,
    Complex,
    Evaluator,
    convexity,
    ellipse_series,
    evaluate,
    slide_direction,
)

Kind = Literal["isotropic", "ellipse", "one_way", "general"]
Frame = Literal["object", "plate", "both"]
KINDS: tuple[Kind, ...] = ("isotropic", "ellipse", "one_way", "general")
"""Each contains the one before it. One-way: an ellipse with a first harmonic; general: with a third and fourth, too."""
_GRID = 360


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """The variation of ln mu with the direction, about its mean. Each field is a cosine's and a sine's coefficient.

    `stretch` is the ellipse: ln(mu_1/mu_2) at twice the direction of mu_1. `one_way`, `third` and `fourth` are the
    harmonics of order 1, 3 and 4 that multiply it.
    """

    stretch: tuple[float, float] = (0.0, 0.0)
    one_way: tuple[float, float] = (0.0, 0.0)
    third: tuple[float, float] = (0.0, 0.0)
    fourth: tuple[float, float] = (0.0, 0.0)

    def series(self) -> Complex:
        """Returns coefficients a (ORDER + 1,) of ln mu = Re sum a_k exp(−i k phi), without the mean."""
        series = ellipse_series(*self.stretch)
        for order, pair in zip(ODD, (self.one_way, self.third, self.fourth), strict=True):
            series[order] += complex(*pair)
        return series


@dataclass(frozen=True, slots=True, kw_only=True)
class Ellipse:
    """mu_1, the higher, along `axis_rad` (in [0, 180°) from the frame's x), and mu_2 across it."""

    mu_1: float
    mu_2: float
    axis_rad: float

    def mu(self, phi_rad: ArrayLike) -> Array:
        """Returns the friction (n,) of a slide in the direction phi (n,)."""
        along = np.asarray(phi_rad, dtype=np.float64) - self.axis_rad
        return cast(Array, np.hypot(self.mu_1 * np.cos(along), self.mu_2 * np.sin(along)))


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitCurve:
    """Friction by direction: `level`, the geometric mean over all directions, times the shapes.

    Directions are those of the slide, in radians, against the frame's x: the object's, or the plate's. In the frame
    "both" they are against the object, and `orientation_rad` is the object's yaw against the plate; elsewhere it has no
    effect. Friction in the direction phi is the support function of the limit curve: what the force does along phi.
    """

    level: float
    frame: Frame = "object"
    object: Shape = Shape()
    plate: Shape = Shape()

    def series(self, orientation_rad: float = 0.0) -> Complex:
        """Returns the series (ORDER + 1,) of ln mu in the frame, at one orientation of the object on the plate."""
        if self.frame == "object":
            return self.object.series()
        if self.frame == "plate":
            return self.plate.series()
        return self.object.series() + self.plate.series() * np.exp(-1j * np.arange(ORDER + 1) * orientation_rad)

    def mu(self, phi_rad: ArrayLike, *, orientation_rad: float = 0.0) -> Array:
        """Returns the friction coefficient (n,) while the block begins to slide in the directions phi (n,)."""
        return self.level * np.exp(evaluate(self.series(orientation_rad), phi_rad).log)

    def force(self, phi_rad: ArrayLike, *, orientation_rad: float = 0.0) -> Array:
        """Returns the force (n,) that the contact holds, over normal force, against pulls in directions phi (n,), rad.

        This is the limit curve's radius and the tangent of the tilt at which the block starts.
        """
        slide = self.slide(phi_rad, orientation_rad=orientation_rad)
        local = evaluate(self.series(orientation_rad), slide)
        return self.level * np.exp(local.log) * np.hypot(1.0, local.slope)

    def slide(self, pull_rad: ArrayLike, *, orientation_rad: float = 0.0) -> Array:
        """Returns the directions (n,), rad, in which a block begins to slide when pulled towards `pull_rad` (n,)."""
        pull = np.asarray(pull_rad, dtype=np.float64)
        both = Evaluator([self.series(orientation_rad)])
        return slide_direction(lambda phi: both(phi)[1:, 0], pull.ravel()).reshape(pull.shape)

    def convexity(self, *, orientation_rad: float = 0.0) -> float:
        """Gives the least of (mu + mu″) / mu over all directions: a limit curve is convex where it is not negative."""
        return float(convexity(evaluate(self.series(orientation_rad), _circle())).min())

    def ellipse(self, *, orientation_rad: float = 0.0) -> Ellipse:
        """Returns the nearest ellipse: least squares of ln mu over the circle. One-way friction is lost in it."""
        series = self.series(orientation_rad)
        # The second harmonic of an ellipse is rho = tanh(stretch / 2), and this is where least squares begin.
        stretch, target = _stretch(complex(series[2])), evaluate(series, _circle()).log
        for _ in range(20):
            residual = target - evaluate(ellipse_series(*stretch), _circle()).log
            jacobian = _slopes(stretch)
            step = np.linalg.lstsq(jacobian, residual)[0]
            stretch = (stretch[0] + float(step[0]), stretch[1] + float(step[1]))
            if float(np.abs(step).max()) < 1e-10:
                break
        size = math.hypot(*stretch)
        # ln mu_1 mu_2 / 2 is the mean of ln mu less that of an ellipse with mu_1 mu_2 = 1.
        middle = self.level / math.cosh(size / 2)
        axis = 0.5 * math.atan2(stretch[1], stretch[0]) % math.pi
        return Ellipse(mu_1=middle * math.exp(size / 2), mu_2=middle * math.exp(-size / 2), axis_rad=axis)


def _circle() -> Array:
    return np.linspace(0, 2 * math.pi, _GRID, endpoint=False)


def _stretch(second: complex) -> tuple[float, float]:
    size = min(abs(second), 0.9)
    scale = 2 * math.atanh(size) / size if size > 1e-12 else 2.0
    return second.real * scale, second.imag * scale


def _slopes(stretch: tuple[float, float], *, step: float = 1e-5) -> Array:
    """Returns derivatives (360, 2) of an ellipse's ln mu."""
    columns: list[Array] = []
    for by_cos, by_sin in ((step, 0.0), (0.0, step)):
        ahead = evaluate(ellipse_series(stretch[0] + by_cos, stretch[1] + by_sin), _circle()).log
        behind = evaluate(ellipse_series(stretch[0] - by_cos, stretch[1] - by_sin), _circle()).log
        columns.append((ahead - behind) / (2 * step))
    return np.column_stack(columns)
