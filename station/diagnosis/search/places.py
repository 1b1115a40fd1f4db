"""The places where residuals may stand out: every channel against every covariate, as smooth columns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.inference.sparse import Table, by_channel, side_by_side
from station.diagnosis.observations.channel import Channel
from station.diagnosis.observations.covariates import ANGLES
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.plate import Times
from station.physics.contact import Array

DEPENDENT = 1e-3
"""Singular values below this share of the largest belong to columns that repeat others."""

SET_BY_FRICTION = frozenset({"speed", "slide_time", "tilt", "tilt_rate"})
"""A run's own friction sets these of its slide, after the onset as read: one that is read late makes both the slide
younger and its friction smaller than the onset's. So friction along the slide is compared with them within each run: a
null had p 1e-9 for the time since the onset (`python -m tests.proof --tier own/null:60 --no-refits --seed 20261540`).
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


def places_of(evidence: Evidence, first_column: int) -> tuple[list[Place], Table]:
    """Returns all places, and their columns (stacked rows, K), numbered from `first_column` on."""
    found, parts, number = list[Place](), list[Table](), first_column
    for channel in evidence.channels:
        scale = np.median(channel.rows.sigma) if not channel.shares_friction else 0.01
        for name, basis in _bases(channel).items():
            place = Place(channel, name, basis * scale, tuple(range(number, number + basis.shape[1])))
            parts.append(by_channel(evidence, {channel.name: place.basis}, basis.shape[1]))
            number += basis.shape[1]
            found.append(place)
    return found, side_by_side(evidence, parts)


def _bases(channel: Channel) -> dict[str, Array]:
    covariates = dict(channel.rows.covariates)
    bases: dict[str, Array] = {}
    if "x" in covariates and "y" in covariates:
        spot = _spot(covariates.pop("x"), covariates.pop("y"))
        if spot is not None:
            bases["position"] = spot
    for name, values in covariates.items():
        basis = _angle(values) if name in ANGLES else _smooth(values, least_spread(name), 4 if name == "run" else 3)
        if basis is not None and name in SET_BY_FRICTION and channel.shares_friction:
            basis = _independent(_within(basis, channel.rows.run))
        if basis is not None:
            bases[name] = basis
    if channel.level_tells:
        bases[EVERYWHERE] = np.ones((len(channel), 1))
    return bases


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
    columns = [np.where(known, wave, wave[known].mean()) for wave in waves]
    return _independent(np.column_stack(columns))


def _smooth(values: Array, least: float, order: int) -> Array | None:
    """Returns polynomials (n, k) of the standardised values (n,), unknown ones at the median.

    It is None if they hardly vary.
    """
    known = np.isfinite(values)
    if known.sum() < thresholds.LEAST_ROWS:
        return None
    spread = np.ptp(np.quantile(values[known], (0.05, 0.95)))
    if not spread > least:
        return None
    middle = float(np.median(values[known]))
    scaled = np.where(known, np.clip((np.where(known, values, middle) - middle) / spread, -1.5, 1.5), 0.0)
    distinct = len(np.unique(np.round(scaled, 3)))
    return _independent(np.column_stack([scaled**k for k in range(1, min(order, distinct - 1) + 1)]))


def _spot(x: Array, y: Array) -> Array | None:
    if len(x) < thresholds.LEAST_ROWS or max(np.ptp(x), np.ptp(y)) < thresholds.LEAST_PLACES_M:
        return None
    u, v = x / 0.03, y / 0.03
    return _independent(np.column_stack([u, v, u * u, u * v, v * v]))


def _within(columns: Array, run: Times) -> Array:
    """Returns the columns (n, k) less their means over each of the runs (n,) that have several rows."""
    count = np.bincount(run)
    means = np.column_stack([np.bincount(run, column) for column in columns.T]) / np.maximum(count, 1)[:, None]
    return np.where((count > 1)[run, None], columns - means[run], columns)


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
