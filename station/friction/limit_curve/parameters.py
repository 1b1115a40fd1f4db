"""The parameters of a likelihood: their names, bounds and scales, and the series that the shape's come to."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from station.friction.direction import Array
from station.friction.limit_curve.series import ODD, ORDER, STEEPEST, Complex
from station.friction.limit_curve.shape import Frame, Kind, LimitCurve, Shape

NUISANCE = ("level", "drift", "log_scatter", "tail", "log_direction_scatter", "direction_tail")
"""The parameters of every model: ln of the level; ln mu's change over half a session; ln of the scatter of ln mu, and
of the direction of the pull (rad); one over the degrees of freedom of either, 0 for normal tails."""
_HARMONICS: dict[Kind, tuple[int, ...]] = {"isotropic": (), "ellipse": (), "one_way": (1,), "general": ODD}
LEAST_SLIDE_SCATTER_RAD = 3e-3
"""One ease for all directions is right to some 0.2°, so slides are not believed to be more regular than that. It is the
slide's own, whatever the curve makes of an error of the pull: a curve with corners in the directions of tilting would
else make slides as regular as one likes."""
_BOUNDS = {
    "level": (-5.0, 3.0),
    "drift": (-1.0, 1.0),
    "log_scatter": (math.log(1e-4), 0.5),
    "tail": (0.0, 0.5),
    "log_direction_scatter": (math.log(1e-4), 0.5),
    "direction_tail": (0.0, 0.5),
    "ease": (0.0, 1.1),
    "turn": (-0.5, 0.5),
    "stretch": (-STEEPEST, STEEPEST),
    "harmonic": (-0.7, 0.7),
}
NORMAL = 1e-4
"""A tail below this is taken as none."""
UNBOUNDED = ("ease",)
"""Parameters whose uncertainty is told as if they had no bounds. An ease above 1 has no meaning in physics; up to 1.1
is let in, as noise must not pile up at the bound."""


@dataclass(frozen=True)
class Layout:
    """The parameters of a model, in their order.

    Beside `NUISANCE` there are `turn` (rad; how far the camera is turned against the tilting axes), for a curve that
    is not isotropic `ease` (by how much a slide under way bends towards the pull, see `series`), and the coefficients
    of the shapes, named frame.order.part; order 2 is the ellipse's stretch.
    """

    kind: Kind
    frame: Frame

    @cached_property
    def shape_names(self) -> tuple[str, ...]:
        """Names of the shape's parameters."""
        if self.kind == "isotropic":
            return ()
        frames = ("object", "plate") if self.frame == "both" else (self.frame,)
        orders = (2, *_HARMONICS[self.kind])
        return tuple(f"{frame}.{order}.{part}" for frame in frames for order in orders for part in ("cos", "sin"))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of all parameters."""
        return (*NUISANCE, "turn", *(("ease",) if self.shape_names else ()), *self.shape_names)

    def index(self, name: str) -> int:
        """Returns the place of a parameter."""
        return self.names.index(name)

    def bounds(self) -> list[tuple[float, float]]:
        """Returns the least and greatest values (k,)."""
        return [_BOUNDS[_family(name)] for name in self.names]

    def shape(self, values: Array, frame: str) -> Shape:
        """Returns the shape in one frame, by the `values` (k,) of the parameters, each in its own unit."""
        found = {name: float(value) for name, value in zip(self.names, values, strict=True)}

        def pair(order: int) -> tuple[float, float]:
            return found.get(f"{frame}.{order}.cos", 0.0), found.get(f"{frame}.{order}.sin", 0.0)

        return Shape(stretch=pair(2), one_way=pair(1), third=pair(3), fourth=pair(4))

    def curve(self, values: Array) -> LimitCurve:
        """Returns the limit curve at some values (k,)."""
        return LimitCurve(
            level=math.exp(float(values[0])),
            frame=self.frame,
            object=self.shape(values, "object"),
            plate=self.shape(values, "plate"),
        )

    def slopes(self, values: Array, frame: str) -> list[tuple[int, Complex]]:
        """Returns the place of each shape parameter of a frame, and the derivative (ORDER + 1,) of the series by it.

        `values` (k,) are the parameters, each in its own unit.
        """
        found: list[tuple[int, Complex]] = []
        stretch = self.shape(values, frame).stretch
        for index, name in enumerate(self.names):
            if not name.startswith(f"{frame}."):
                continue
            order, part = int(name.split(".")[1]), name.split(".")[2]
            unit = 1.0 if part == "cos" else 1.0j
            if order == 2:
                found.append((index, _stretch_slope(complex(*stretch), unit)))
            else:
                series = np.zeros(ORDER + 1, dtype=np.complex128)
                series[order] = unit
                found.append((index, series))
        return found


def _family(name: str) -> str:
    if "." not in name:
        return name
    return "stretch" if name.split(".")[1] == "2" else "harmonic"


def _stretch_slope(stretch: complex, unit: complex) -> Complex:
    """Returns the derivative of `ellipse_series` along a unit of the stretch."""
    size = abs(stretch)
    if size > 1e-6:
        share = math.tanh(size / 2) / size
        fall = (0.5 / math.cosh(size / 2) ** 2 - share) / size
        ratio_slope = unit * share + stretch * fall * (stretch.conjugate() * unit).real / size
        ratio = stretch * share
    else:
        ratio_slope, ratio = 0.5 * unit, 0.5 * stretch
    series = np.zeros(ORDER + 1, dtype=np.complex128)
    series[2::2] = (-ratio) ** np.arange(ORDER // 2) * ratio_slope
    return series


def extended(layout: Layout, values: Array, *, to: Layout, ease: float) -> Array:
    """Returns the `values` (k,) of a model as a start (m,) of another: those that it lacks are 0, but for the ease.

    Each is in its parameter's own unit.
    """
    known = dict(zip(layout.names, values.tolist(), strict=True))
    return np.array([known.get(name, ease if name == "ease" else 0.0) for name in to.names])
