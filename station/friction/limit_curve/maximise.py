"""The maximum of a likelihood, and how sharp it is."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from station.friction.direction import Array
from station.friction.limit_curve.climb import climb
from station.friction.limit_curve.likelihood import Likelihood
from station.friction.limit_curve.observations import Observations
from station.friction.limit_curve.parameters import UNBOUNDED, Layout, extended

_AT_BOUND = 3e-3
_EASES = (0.95, 0.05)


@dataclass(frozen=True, eq=False)
class Maximum:
    """The parameters (k,) at the maximum, ln of the likelihood there, and their covariance (k, k).

    The covariance is Laplace's: the inverse of the likelihood's curvature. A tail of 0 has none, and is taken as known.
    """

    layout: Layout
    values: Array
    log_likelihood: float
    covariance: Array
    count: int

    @property
    def bic(self) -> float:
        """Schwarz's criterion: smaller is better."""
        return len(self.values) * math.log(self.count) - 2 * self.log_likelihood

    def sigma(self, slope: Array) -> float:
        """Returns the standard error of what changes by `slope` (k,) with the parameters."""
        return math.sqrt(max(float(slope @ self.covariance @ slope), 0.0))


def first_guess(observations: Observations) -> Array:
    """Returns values (k,) of the isotropic model from which every fit begins."""
    layout = Layout("isotropic", "object")
    known = observations.pull[observations.resolved]
    start = dict.fromkeys(layout.names, 0.0)
    start["level"] = float(np.median(known))
    start["log_scatter"] = math.log(max(_spread(known), 0.01))
    off = observations.slide_rad - observations.towards_object_rad
    off = (off[np.isfinite(off)] + math.pi) % (2 * math.pi) - math.pi
    start["log_direction_scatter"] = math.log(max(_spread(off), 0.005))
    start["tail"] = start["direction_tail"] = 0.1
    return np.array(list(start.values()))


def _spread(values: Array) -> float:
    return 1.4826 * float(np.median(np.abs(values - np.median(values)))) if len(values) else 0.1


def maximise(layout: Layout, observations: Observations, *, start: Array, start_layout: Layout) -> Maximum:
    """Climbs from the values `start` (k,) of another model, each in its parameter's own unit.

    Where that has no ease the climb is made twice: from slides that go by maximum dissipation, and from ones that just
    go downhill. A block that slides straight though friction depends on the direction is else taken for isotropic.
    """
    eases = _EASES if "ease" in layout.names and "ease" not in start_layout.names else _EASES[:1]
    likelihood = Likelihood(layout, observations)
    tops = [_top(likelihood, start, start_layout, ease) for ease in eases]
    values, total = max(tops, key=lambda top: top[1])
    return Maximum(layout, values, total, _covariance(likelihood, values, start), len(observations))


def _top(likelihood: Likelihood, start: Array, start_layout: Layout, ease: float) -> tuple[Array, float]:
    layout = likelihood.layout
    low, high = _bounds(layout)
    scale = _scales(layout, start, len(likelihood.data))
    origin = np.clip(extended(start_layout, start, to=layout, ease=ease), low, high)

    def height(shifted: Array) -> tuple[float, Array]:
        total, gradient = likelihood(origin + scale * shifted)
        return total, gradient * scale

    shift = climb(height, np.zeros(len(origin)), low=(low - origin) / scale, high=(high - origin) / scale)
    values = np.clip(origin + scale * shift, low, high)
    return values, likelihood(values)[0]


def _bounds(layout: Layout) -> tuple[Array, Array]:
    low, high = zip(*layout.bounds(), strict=True)
    return np.array(low), np.array(high)


def _scales(layout: Layout, start: Array, count: int) -> Array:
    """Returns the scale (k,) of each parameter, about its standard error, so that the climb goes as fast along each."""
    scatter, spread = math.exp(start[2]), math.exp(start[4])
    root = math.sqrt(max(count, 1))
    fixed = {"log_scatter": 0.8, "log_direction_scatter": 0.8, "tail": 0.7, "direction_tail": 0.7, "turn": spread}
    fixed |= {"ease": 2.0, "drift": 1.7 * scatter}
    return np.array([fixed.get(name, 1.4 * scatter if "." in name else scatter) / root for name in layout.names])


def _covariance(likelihood: Likelihood, values: Array, start: Array) -> Array:
    low, high = _bounds(likelihood.layout)
    scale = _scales(likelihood.layout, start, len(likelihood.data))
    unbounded = np.array([name in UNBOUNDED for name in likelihood.layout.names])
    free = np.flatnonzero(unbounded | ((values > low + _AT_BOUND) & (values < high - _AT_BOUND)))
    curvature = np.zeros((len(free), len(free)))
    for row, index in enumerate(free.tolist()):
        room = np.inf if unbounded[index] else 0.5 * min(values[index] - low[index], high[index] - values[index])
        # First a step that is surely short, then one of a tenth of the standard error that it makes out.
        sharp = -_slope_of_slope(likelihood, values, index, min(1e-3 * scale[index], room))[index]
        step = min(0.1 / math.sqrt(sharp) if sharp > 0 else scale[index], scale[index], room)
        curvature[row] = -_slope_of_slope(likelihood, values, index, step)[free]
        scale[index] = min(scale[index], 10 * step)
    curvature = 0.5 * (curvature + curvature.T) * np.outer(scale[free], scale[free])
    size, ways = np.linalg.eigh(curvature)
    # Where the likelihood hardly falls nothing is known: very wide, but not endless.
    inverse = (ways / np.maximum(size, 1e-4)) @ ways.T
    covariance = np.zeros((len(values), len(values)))
    covariance[np.ix_(free, free)] = inverse * np.outer(scale[free], scale[free])
    return covariance


def _slope_of_slope(likelihood: Likelihood, values: Array, index: int, step: float) -> Array:
    """Returns the change of the gradient (k,) with one parameter."""
    ahead, behind = values.copy(), values.copy()
    ahead[index] += step
    behind[index] -= step
    return (likelihood(ahead)[1] - likelihood(behind)[1]) / (2 * step)
