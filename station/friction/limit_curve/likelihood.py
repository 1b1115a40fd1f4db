"""The likelihood of limit curve, scatter and nuisances: of every run's onset and slide, given its covariates.

For run i, pulled towards delta_i, the curve gives ln g_i, the pull at which it should start, and phi_i, where it should
go (`series`). Then

    ln tan(onset) = ln g_i + drift · place + scatter · t,          t Student's, or normal
    slide         = phi_i + turn + error,

where the error has the measured direction's own variance, a least one, and that of the pull's direction (a plate off
level, a knock, a bump), magnified by dphi/ddelta: by up to (mu_1/mu_2)² where friction is highest, which is why slides
keep away from there. Censored runs give the probability of holding on, brackets that of their interval; a run that
would have gone unseen below a pull is divided by the probability of being seen. A hinge keeps the curve convex.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from scipy import special

from station.friction.direction import Array
from station.friction.limit_curve.observations import Observations
from station.friction.limit_curve.parameters import LEAST_SLIDE_SCATTER_RAD, NORMAL, Layout
from station.friction.limit_curve.series import Evaluator, Local, convexity, slide_direction

_SPECIAL = cast(Any, special)  # compiled functions without annotations
_LEAST_CONVEXITY = 0.03
_HINGE = 3e3
_GRID: Array = np.linspace(0, 2 * math.pi, 120, endpoint=False)
_ORIENTATIONS: Array = np.linspace(0, 2 * math.pi, 12, endpoint=False)
_ONE: Array = np.zeros(1)


@dataclass(frozen=True, eq=False)
class _Point:
    """The curve at directions (n,) and its derivatives by the shape's parameters, by place."""

    local: Local
    slopes: dict[int, Local]


class Likelihood:
    """ln of the likelihood of some observations under one layout, with its gradient."""

    def __init__(self, layout: Layout, observations: Observations) -> None:
        self.layout, self.data = layout, observations
        self._shaped = bool(layout.shape_names)
        self._frames = ("object", "plate") if layout.frame == "both" else (layout.frame,)
        self._start: tuple[Array, Array] | None = None
        plate = layout.frame == "plate"
        self._towards = observations.towards_plate_rad if plate else observations.towards_object_rad
        turned = observations.orientation_rad
        self._slide = observations.slide_rad + (turned if plate else 0.0)
        self._point = np.flatnonzero(observations.resolved)
        self._interval = np.flatnonzero(~observations.resolved)
        self._unseen = np.flatnonzero(np.isfinite(observations.seen_from))
        self._moved = np.flatnonzero(np.isfinite(observations.slide_rad))

    # --- the curve at the runs -------------------------------------------------------------------------------------

    def _at(self, values: Array, phi: Array, orientation: Array, *, slopes: bool = True) -> _Point:
        layout = self.layout
        local: Local | None = None
        found: dict[int, Local] = {}
        for frame in self._frames:
            there = phi + orientation if (layout.frame, frame) == ("both", "plate") else phi
            by = layout.slopes(values, frame) if slopes else []
            rows = Evaluator([layout.shape(values, frame).series(), *(series for _, series in by)])(there)
            one = Local(*rows[:, 0])
            local = one if local is None else local + one
            found |= {number: Local(*rows[:, k + 1]) for k, (number, _) in enumerate(by)}
        assert local is not None
        return _Point(local, found)

    def _solved(self, values: Array, ease: float) -> tuple[Array, Array]:
        """Returns directions (n,) at the onset and while sliding."""
        if not self._shaped:
            return self._towards, self._towards
        first, *rest = (Evaluator([self.layout.shape(values, frame).series()]) for frame in self._frames)
        turned = self.data.orientation_rad

        def slopes(phi: Array) -> Array:
            found = first(phi)[1:, 0]
            return found + rest[0](phi + turned)[1:, 0] if rest else found

        start, second = self._start or (None, None)
        onset = slide_direction(slopes, self._towards, start_rad=start)
        slide = slide_direction(slopes, self._towards, ease=ease, start_rad=onset if second is None else second)
        self._start = (onset, slide)
        return onset, slide

    def expected_pull(self, values: Array) -> Array:
        """Returns ln tan (n,) of the tilt at which each run should start, for a multiplier of 1.

        `values` (k,) are the parameters of the layout, each in its own unit.
        """
        onset, _ = self._solved(values, self._ease(values))
        local = self._at(values, onset, self.data.orientation_rad, slopes=False).local
        drift = values[self.layout.index("drift")] * self.data.place
        return values[0] + drift + local.log + 0.5 * np.log1p(local.slope**2)

    def _ease(self, values: Array) -> float:
        return float(values[self.layout.index("ease")]) if self._shaped else 1.0

    # --- the sum ---------------------------------------------------------------------------------------------------

    def __call__(self, values: Array) -> tuple[float, Array]:
        """Returns the ln of the likelihood, less the hinge, and its gradient (k,)."""
        ease, turned = self._ease(values), self.data.orientation_rad
        onset, slide = self._solved(values, ease)
        total, gradient = self._onsets(values, self._at(values, onset, turned))
        moved = self._at(values, slide[self._moved], turned[self._moved])
        more, gradient_more = self._slides(values, slide[self._moved], moved, ease)
        hinge, gradient_hinge = self._hinge(values)
        return total + more - hinge, gradient + gradient_more - gradient_hinge

    def _onsets(self, values: Array, point: _Point) -> tuple[float, Array]:
        data, index = self.data, self.layout.index
        scatter, tail = math.exp(values[index("log_scatter")]), float(values[index("tail")])
        size = np.sqrt(scatter**2 + data.pull_sigma**2)
        expected = (
            values[0] + values[index("drift")] * data.place + point.local.log + 0.5 * np.log1p(point.local.slope**2)
        )
        by_pull, by_size = np.zeros(len(data)), np.zeros(len(data))
        at, total, by_tail = self._point, 0.0, 0.0
        if len(at):
            z = (data.pull[at] - expected[at]) / size[at]
            density, by_z, tails = student(z, tail)
            total += float((density - np.log(size[at])).sum())
            by_pull[at] -= by_z / size[at]
            by_size[at] -= (by_z * z + 1.0) / size[at]
            by_tail += float(tails.sum())
        for rows, low, high, sign in (
            (self._interval, data.above, data.below, 1.0),
            (self._unseen, data.seen_from, np.full(len(data), np.inf), -1.0),
        ):
            if len(rows):
                part = _between(
                    (low[rows] - expected[rows]) / size[rows], (high[rows] - expected[rows]) / size[rows], tail
                )
                total += sign * float(part.log.sum())
                by_pull[rows] -= sign * (part.by_low + part.by_high) / size[rows]
                by_size[rows] -= sign * part.by_size / size[rows]
                by_tail += sign * part.by_tail
        gradient = np.zeros(len(values))
        gradient[0] = by_pull.sum()
        gradient[index("drift")] = by_pull @ data.place
        gradient[index("log_scatter")] = float((by_size * scatter**2 / size).sum())
        gradient[index("tail")] = by_tail
        # The onset is the least over all directions, so that its own direction's change does not count.
        for number, slope in point.slopes.items():
            gradient[number] = by_pull @ slope.log
        return total, gradient

    def _slides(self, values: Array, slide: Array, point: _Point, ease: float) -> tuple[float, Array]:
        data, index, rows = self.data, self.layout.index, self._moved
        spread, tail = math.exp(values[index("log_direction_scatter")]), float(values[index("direction_tail")])
        turn = float(values[index("turn")])
        p, bend, jerk = point.local.slope, point.local.bend, point.local.jerk
        square = 1.0 + (ease * p) ** 2
        weight = ease / square
        weight_by_slope = -2.0 * ease**3 * p / square**2
        rise = np.maximum(1.0 + bend * weight, 0.02)
        free = rise > 0.02
        variance = data.slide_sigma_rad[rows] ** 2 + LEAST_SLIDE_SCATTER_RAD**2 + (spread / rise) ** 2
        size = np.sqrt(variance)
        error = (self._slide[rows] - slide - turn + math.pi) % (2 * math.pi) - math.pi
        z = error / size
        density, by_z, tails = student(z, tail)
        by_direction = -by_z / size
        by_size = -(by_z * z + 1.0) / size
        by_rise = -by_size * spread**2 / (rise**3 * size) * free
        gradient = np.zeros(len(values))
        gradient[index("turn")] = by_direction.sum()
        gradient[index("log_direction_scatter")] = float((by_size * (spread / rise) ** 2 / size).sum())
        gradient[index("direction_tail")] = float(tails.sum())
        for number, slope in point.slopes.items():
            phi = -weight * slope.slope / rise
            change = (slope.bend + jerk * phi) * weight + bend * weight_by_slope * (slope.slope + bend * phi)
            gradient[number] = by_direction @ phi + by_rise @ change
        if self._shaped:
            phi = -(p / square) / rise
            by_ease = (1.0 - (ease * p) ** 2) / square**2
            change = jerk * phi * weight + bend * (by_ease + weight_by_slope * bend * phi)
            gradient[index("ease")] = by_direction @ phi + by_rise @ change
        return float((density - np.log(size)).sum()), gradient

    def _hinge(self, values: Array) -> tuple[float, Array]:
        gradient = np.zeros(len(values))
        # An ellipse is convex; nothing else is asked of it.
        if self.layout.kind in ("isotropic", "ellipse") and self.layout.frame != "both":
            return 0.0, gradient
        turns = _ORIENTATIONS if self.layout.frame == "both" else _ONE
        phi, turned = np.tile(_GRID, len(turns)), np.repeat(turns, len(_GRID))
        local = self._at(values, phi, turned, slopes=False).local
        short = np.maximum(_LEAST_CONVEXITY - convexity(local), 0.0)
        if not short.any():
            return 0.0, gradient
        scale = _HINGE / len(turns)
        for number, slope in self._at(values, phi, turned).slopes.items():
            gradient[number] = -2.0 * scale * float(short @ (2.0 * local.slope * slope.slope + slope.bend))
        return scale * float(short @ short), gradient


def student(z: Array, tail: float) -> tuple[Array, Array, Array]:
    """Returns ln of Student's density (n,) at z (n,), its derivative by z, and by the tail (one over the degrees)."""
    if tail < NORMAL:
        # To first order in the tail, so that the optimiser sees the way in.
        return -0.5 * z**2 - 0.5 * math.log(2 * math.pi), -z, (z**4 - 2.0 * z**2 - 1.0) / 4.0
    nu = 1.0 / tail
    kept = 1.0 + tail * z**2
    logs = np.log(kept)
    constant = float(_SPECIAL.gammaln((nu + 1) / 2) - _SPECIAL.gammaln(nu / 2)) - 0.5 * math.log(nu * math.pi)
    slope = 0.5 * float(_SPECIAL.digamma((nu + 1) / 2) - _SPECIAL.digamma(nu / 2)) - 0.5 * tail
    by_nu = slope - 0.5 * logs + 0.5 * (nu + 1) * tail**2 * z**2 / kept
    return constant - 0.5 * (nu + 1) * logs, -(nu + 1) * tail * z / kept, -by_nu * nu**2


@dataclass(frozen=True, eq=False, slots=True)
class _Between:
    """ln of the probability (n,) of an interval, and what it changes by with both ends, the size, and the tail."""

    log: Array
    by_low: Array
    by_high: Array
    by_size: Array
    by_tail: float


def _between(low: Array, high: Array, tail: float) -> _Between:
    log = _log_probability(low, high, tail)
    share = np.exp(-log)
    at_low, at_high = (
        np.where(np.isfinite(z), np.exp(student(np.where(np.isfinite(z), z, 0.0), tail)[0]), 0.0) * share
        for z in (low, high)
    )
    by_size = np.where(np.isfinite(high), high, 0.0) * at_high - np.where(np.isfinite(low), low, 0.0) * at_low
    step = 1e-4
    down = max(tail - step, 0.0)
    by_tail = float((_log_probability(low, high, down + 2 * step) - _log_probability(low, high, down)).sum())
    return _Between(log, -at_low, at_high, by_size, by_tail / (2 * step))


def _log_probability(low: Array, high: Array, tail: float) -> Array:
    # The end nearer to the interval is taken, so that small probabilities keep their digits.
    flip = low > 0
    first, second = np.where(flip, -high, low), np.where(flip, -low, high)
    chance = _below(second, tail) - _below(first, tail)
    return np.log(np.maximum(chance, 1e-300))


def _below(z: Array, tail: float) -> Array:
    if tail < NORMAL:
        return cast(Array, _SPECIAL.ndtr(z))
    return cast(Array, _SPECIAL.stdtr(1.0 / tail, z))
