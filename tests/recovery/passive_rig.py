"""Many passive sessions at once, which bias themselves as the rig does, with a limit curve that is planted.

The block starts where it stopped last; the direction of tilting is drawn by the session's rule from where it lies; the
range of angles narrows to mean ± 3 sd of a direction after 25 samples; runs that reach its end are censored. The block
starts by maximum dissipation, found here by trying all directions, so that nothing is taken from what is tested.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from station.friction.limit_curve.observations import Observations

Floats = NDArray[np.float64]
_HALF_IMAGE_M = 0.05
_LEAST_WAY_M = 0.01
_REACH_M = 0.038
"""The distance of the block's centre from the plate's when the block touches the foam."""
_SEEN_M = 20 / 6000
_TABLE = 2 * math.pi / 1440


def ellipse(mu_1: float, mu_2: float, axis_rad: float = 0.0) -> Callable[[Floats], Floats]:
    """Friction by direction of an elliptic limit curve."""
    return lambda phi: np.hypot(mu_1 * np.cos(phi - axis_rad), mu_2 * np.sin(phi - axis_rad))


@dataclass(frozen=True, kw_only=True)
class Rig:
    """The planted friction and errors. Angles in radians; `one_way` and so on belong into `mu`.

    `excess` is by how much the pull exceeds what holds while the block slides, `unresolved` the share of onsets that
    could not be fitted, `tail_dof` the degrees of freedom of ln mu's scatter (infinite: normal). `fixed_to_plate` says
    that the curve is the plate's. `forgets_early` drops runs that slid before the first angle of a narrowed range.
    """

    mu: Callable[[Floats], Floats]
    scatter: float = 0.1
    tail_dof: float = math.inf
    pull_scatter_rad: float = math.radians(2.0)
    slide_sigma_rad: float = math.radians(0.7)
    onset_sigma_rad: float = math.radians(0.05)
    turning_rad: float = math.radians(20.0)
    excess: float = 0.0
    unresolved: float = 0.1
    reach_rad: float = math.radians(67.5)
    fixed_to_plate: bool = False
    forgets_early: bool = False


@dataclass(frozen=True, eq=False)
class Sessions:
    """Runs of many sessions, (sessions, runs) each: the columns of `Observations`, and `tilt_rad` at the onset."""

    pull: Floats
    pull_sigma: Floats
    above: Floats
    below: Floats
    seen_from: Floats
    towards_object_rad: Floats
    towards_plate_rad: Floats
    slide_rad: Floats
    slide_sigma_rad: Floats
    place: Floats
    tilt_rad: Floats
    kept: NDArray[np.bool_]

    def observations(self, session: int) -> Observations:
        """One session's, without what a filter or the rig left out."""
        kept = self.kept[session]
        return Observations(**{spec.name: getattr(self, spec.name)[session][kept] for spec in fields(Observations)})

    def naive(self, session: int, *, direction_rad: float, half_width_rad: float, plate: bool = False) -> Floats:
        """The paper's mu, tan |arcsin s_z|, of the slides that went about in one direction of the object or plate."""
        kept = self.kept[session] & np.isfinite(self.slide_rad[session]) & np.isfinite(self.pull[session])
        slide, towards = self.slide_rad[session][kept], self.towards_object_rad[session][kept]
        mu = np.tan(np.arcsin(np.sin(self.tilt_rad[session][kept]) * np.cos(slide - towards)))
        turned = self.towards_plate_rad[session][kept] - towards if plate else 0.0
        near = np.abs((slide + turned - direction_rad + math.pi) % (2 * math.pi) - math.pi) < half_width_rad
        return mu[near]


class _Curve:
    """Onset pull and slide by the direction of the pull, from a table of all directions."""

    def __init__(self, mu: Callable[[Floats], Floats], excess: float) -> None:
        phi = np.arange(0.0, 2 * math.pi, _TABLE)
        friction = mu(phi)
        off = np.cos(phi[:, None] - phi)  # pulls by slides
        with np.errstate(divide="ignore"):
            self.pull = np.where(off > 1e-3, friction / off, np.inf).min(axis=1)
        surplus = (1.0 + excess) * self.pull[:, None] * off - friction
        best = surplus.argmax(axis=1)
        # A parabola through the three best, as the table is coarse.
        at = np.arange(len(phi))
        left, mid, right = (surplus[at, (best + shift) % len(phi)] for shift in (-1, 0, 1))
        fine = phi[best] + _TABLE * 0.5 * (left - right) / np.minimum(left - 2 * mid + right, -1e-12)
        self.turn = (fine - phi + math.pi) % (2 * math.pi) - math.pi

    def onset(self, towards: Floats) -> Floats:
        return self._look_up(self.pull, towards)

    def slide(self, towards: Floats) -> Floats:
        return towards + self._look_up(self.turn, towards)

    def _look_up(self, table: Floats, towards: Floats) -> Floats:
        place = towards % (2 * math.pi) / _TABLE
        low = place.astype(np.int64) % len(table)
        share = place - np.floor(place)
        return (1 - share) * table[low] + share * table[(low + 1) % len(table)]


def sessions(rig: Rig, *, count: int, runs: int, rng: np.random.Generator) -> Sessions:
    """Plays `count` sessions of `runs` runs each, all at once."""
    curve = _Curve(rig.mu, rig.excess)
    place_m, yaw = rng.uniform(-0.02, 0.02, (count, 2)), rng.uniform(-math.pi, math.pi, count)
    past = np.zeros((count, 4, 3))
    found: dict[str, list[NDArray[np.generic]]] = {spec.name: [] for spec in fields(Sessions)}
    every = np.arange(count)
    for run in range(runs):
        beta, sector = _directions(place_m, rng)
        low, high = _range(past[every, sector], rig.reach_rad)
        downhill = beta - math.pi / 2
        towards = downhill if rig.fixed_to_plate else downhill - yaw
        pulled = towards + rig.pull_scatter_rad * rng.standard_normal(count)
        chance = rng.standard_normal(count) if math.isinf(rig.tail_dof) else rng.standard_t(rig.tail_dof, count)
        tilt = np.arctan(curve.onset(pulled) * np.exp(rig.scatter * chance))
        slid, early = tilt <= high, tilt < low
        way = curve.slide(pulled) + (downhill - towards)
        length = np.minimum(rng.uniform(0.005, 0.012, count), _to_foam(place_m, way))
        seen = tilt + rig.onset_sigma_rad * rng.standard_normal(count)
        unresolved = rng.random(count) < rig.unresolved
        step = (high - low) / 50
        begin = np.where(early, 0.0, low + np.floor((tilt - low) / step) * step)
        end = np.where(early, low, begin + step)
        row = {
            "pull": np.where(slid & ~unresolved, np.log(np.tan(seen)), np.nan),
            "pull_sigma": 2 * rig.onset_sigma_rad / np.sin(2 * seen),
            "above": _log_tan(np.where(slid, begin, high)),
            "below": np.where(slid, _log_tan(end), np.inf),
            "seen_from": _log_tan(low) if rig.forgets_early else np.full(count, -np.inf),
            "towards_object_rad": downhill - yaw,
            "towards_plate_rad": downhill,
            "slide_rad": np.where(slid, way - yaw + rig.slide_sigma_rad * rng.standard_normal(count), np.nan),
            "slide_sigma_rad": np.full(count, rig.slide_sigma_rad),
            "place": np.full(count, 2 * run / max(runs - 1, 1) - 1),
            "tilt_rad": seen,
            "kept": (~slid | (length > _SEEN_M)) & ~(rig.forgets_early & early),
        }
        for name, values in row.items():
            found[name].append(values)
        told = np.where(slid, np.where(unresolved, end, seen), 0.0)
        past[every, sector] += np.column_stack([slid, told, told**2])
        place_m = place_m + np.where(slid, length, 0.0)[:, None] * np.column_stack([np.cos(way), np.sin(way)])
        yaw = yaw + np.where(slid, rig.turning_rad, 0.0) * rng.standard_normal(count)
    return Sessions(**{name: np.stack(values, axis=1) for name, values in found.items()})  # pyright: ignore[reportArgumentType]


def _log_tan(tilt_rad: Floats) -> Floats:
    with np.errstate(divide="ignore"):
        return np.log(np.tan(tilt_rad))


def _directions(place_m: Floats, rng: np.random.Generator) -> tuple[Floats, NDArray[np.int64]]:
    """Azimuths of the tilting axis and their numbers: drawn with the distance to the border as weight."""
    beta: Floats = np.array([0.0, 0.5, 1.0, 1.5]) * math.pi
    ways = np.column_stack([np.sin(beta), -np.cos(beta)])
    distance = np.maximum(_HALF_IMAGE_M - place_m @ ways.T, 0.0)
    weight = np.where(distance >= _LEAST_WAY_M, distance, 0.0)
    bounds = np.cumsum(weight / weight.sum(axis=1, keepdims=True), axis=1)
    number = np.minimum((rng.random((len(place_m), 1)) > bounds).sum(axis=1), 3)
    return beta[number], number


def _range(past: Floats, reach_rad: float) -> tuple[Floats, Floats]:
    """Lowest and highest angle, from number, sum and sum of squares of a direction's onsets."""
    number = past[:, 0]
    mean = past[:, 1] / np.maximum(number, 1)
    sd = np.sqrt(np.maximum(past[:, 2] - number * mean**2, 0.0) / np.maximum(number - 1, 1))
    narrowed = number >= 25
    low = np.where(narrowed, np.maximum(mean - 3 * sd, 0.0), 0.0)
    return low, np.where(narrowed, np.minimum(mean + 3 * sd, reach_rad), reach_rad)


def _to_foam(place_m: Floats, way_rad: Floats) -> Floats:
    way = np.column_stack([np.cos(way_rad), np.sin(way_rad)])
    along = (place_m * way).sum(axis=1)
    return np.maximum(-along + np.sqrt(np.maximum(along**2 + _REACH_M**2 - (place_m**2).sum(axis=1), 0.0)), 0.0)
