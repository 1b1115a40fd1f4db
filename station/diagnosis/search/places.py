"""The places where residuals may stand out: every channel against every covariate, as smooth columns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.inference.sparse import Sloped, side_by_side, sloped
from station.diagnosis.observations.channel import Channel
from station.diagnosis.observations.covariates import ANGLES
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.plate import Times
from station.physics.contact import Array, Bools
from station.physics.smooth import Powers

DEPENDENT = 1e-3
"""Singular values below this share of the largest belong to columns that repeat others."""

SET_BY_FRICTION = frozenset({"speed", "slide_time", "tilt", "tilt_rate"})
"""A run's own friction sets these of its slide, after the onset as read: one that is read late makes both the slide
younger and its friction smaller than the onset's. So friction along the slide is compared with what has changed of them
since the run's first row: a null had p 1e-9 for the time since the onset (`python -m tests.proof --tier own/null:60
--no-refits --seed 20261540`). The difference from a run's mean would know what comes later, which friction has set as
well (Nickell 1981, Econometrica 49, 1417): a null of a steep plate had p 1e-8 for the speed.
"""

EVERYWHERE = "all"
"""The place of a channel's common level."""

CONSTANT = 1e-9
"""A covariate whose spread is smaller is constant but for rounding."""


@dataclass(frozen=True, eq=False)
class Place:
    """A channel and a covariate, with smooth columns (channel's rows, k) and the columns' numbers in the scores."""

    channel: Channel
    covariate: str
    basis: Array
    columns: tuple[int, ...]

    @property
    def phase(self) -> str:
        """The phase of a run in which the channel is seen."""
        return self.channel.phase


def places_of(evidence: Evidence, first_column: int) -> tuple[list[Place], Sloped]:
    """Returns all places, and their columns (stacked rows, K), numbered from `first_column` on."""
    found, parts, number = list[Place](), list[Sloped](), first_column
    for channel in evidence.channels:
        scale = float(np.median(channel.rows.sigma)) if not channel.shares_friction else 0.01
        for name, basis in _bases(channel).items():
            count = basis.columns.shape[1]
            place = Place(channel, name, basis.columns * scale, tuple(range(number, number + count)))
            undone = {channel.name: basis.undone * scale}
            parts.append(sloped(evidence, {channel.name: place.basis}, count, undone))
            number += count
            found.append(place)
    return found, side_by_side(evidence, parts)


class _Basis(NamedTuple):
    """Columns (n, k) of a channel, and the change (n, k) of its `decay` by them."""

    columns: Array
    undone: Array

    @staticmethod
    def of(columns: Array | None, undone: Array | float = 0.0) -> _Basis | None:
        """Returns independent columns for those given (n, m), with what they undo (n, m); None if there are none."""
        found = None if columns is None else _independent(columns)
        if columns is None or found is None:
            return None
        combined = np.linalg.lstsq(columns - columns.mean(axis=0), found)[0]
        return _Basis(found, np.broadcast_to(undone, columns.shape) @ combined)


def _bases(channel: Channel) -> dict[str, _Basis]:
    covariates = dict(channel.rows.covariates)
    bases: dict[str, _Basis | None] = {}
    if "x" in covariates and "y" in covariates:
        bases["position"] = _Basis.of(_spot(covariates.pop("x"), covariates.pop("y")))
    for name, values in covariates.items():
        bases[name] = _Basis.of(_angle(values)) if name in ANGLES else _smooth(channel, name, values)
    if channel.level_tells:
        ones = np.ones((len(channel), 1))
        bases[EVERYWHERE] = _Basis(ones, np.zeros_like(ones))
    return {name: basis for name, basis in bases.items() if basis is not None}


def least_spread(covariate: str) -> float:
    """Returns the spread that a covariate needs to explain anything, in its own unit."""
    return thresholds.LEAST_DWELL_S if covariate == "dwell" else CONSTANT


def _angle(angle: Array) -> Array | None:
    """Returns harmonics (n, k) of an angle (n,), up to the third if enough distinct angles occur.

    It is None if it hardly varies.
    """
    known = np.isfinite(angle)
    if known.sum() < max(thresholds.LEAST_ROWS, thresholds.LEAST_KNOWN_SHARE * len(angle)):
        return None
    turned = np.exp(1j * angle[known])
    if 1.0 - abs(turned.mean()) < 0.5 * thresholds.LEAST_SPREAD_RAD**2:
        return None
    distinct = len(np.unique(np.round(np.mod(angle[known], 2 * np.pi) / 0.1)))
    order = 3 if distinct > 8 else 2 if distinct > 3 else 1
    waves = [wave(k * np.where(known, angle, 0.0)) for k in range(1, order + 1) for wave in (np.cos, np.sin)]
    return np.column_stack([np.where(known, wave, wave[known].mean()) for wave in waves])


def _smooth(channel: Channel, name: str, values: Array) -> _Basis | None:
    """Returns the powers of a covariate's values (n,), unknown ones at the median; None if they hardly vary."""
    begin, begins = _begins(values, channel.rows.run) if _is_set(channel, name) else (0.0, False)
    form = _powers(values - begin, least_spread(name), 4 if name == "run" else 3)
    if form is None:
        return None
    undone = channel.undone(name, lambda changed: np.where(begins, 0.0, form.of(changed - begin)))
    return _Basis.of(form.of(values - begin), undone)


def _powers(values: Array, least: float, order: int) -> Powers | None:
    known = np.isfinite(values)
    if known.sum() < thresholds.LEAST_ROWS:
        return None
    spread = np.ptp(np.quantile(values[known], (0.05, 0.95)))
    if not spread > least:
        return None
    middle = float(np.median(values[known]))
    distinct = len(np.unique(np.round((values[known] - middle) / spread, 3)))
    return Powers(middle=middle, spread=float(spread), degree=min(order, distinct - 1))


def _spot(x: Array, y: Array) -> Array | None:
    if len(x) < thresholds.LEAST_ROWS or max(np.ptp(x), np.ptp(y)) < thresholds.LEAST_PLACES_M:
        return None
    u, v = x / 0.03, y / 0.03
    return np.column_stack([u, v, u * u, u * v, v * v])


def _is_set(channel: Channel, covariate: str) -> bool:
    """Returns true if a run's own friction sets the covariate in a channel of several rows a run."""
    return covariate in SET_BY_FRICTION and channel.shares_friction and bool(np.any(np.diff(channel.rows.run) == 0))


def _begins(values: Array, run: Times) -> tuple[Array, Bools]:
    """Returns the value (n,) of the first row of each row's run (n,), and which rows (n, 1) are that one."""
    _, first, of = np.unique(run, return_index=True, return_inverse=True)
    return values[first][of], (np.arange(len(run)) == first[of])[:, None]


def _independent(columns: Array) -> Array | None:
    """Returns orthonormal columns, times the root of their length, spanning the centred columns.

    It is None if these are constant.
    """
    centred = columns - columns.mean(axis=0)
    left, size, _ = np.linalg.svd(centred, full_matrices=False)
    kept = size > DEPENDENT * max(float(size[0]), 1e-12) if len(size) else np.zeros(0, dtype=np.bool_)
    if not len(size) or size[0] < CONSTANT:
        return None
    return left[:, kept] * np.sqrt(len(columns))
