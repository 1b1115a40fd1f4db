# ruff: noqa: PLR0917 (compiled functions take no keyword-only arguments)
"""The compiled log likelihood of each moment of slip of `breakaway`: place, creep and D are integrated out."""

from __future__ import annotations

from typing import Any

import numpy as np

from station.compiled import compiled
from station.diagnosis.observations.breakaway_kernel import room, shoot
from station.diagnosis.observations.breakaway_tables import Along, Laws
from station.physics.contact import Array

UNLIKELY = -1e9
"""The log likelihood of a path that runs away, as where friction falls steeply at next to no speed. A moment of slip
that is no number would be looked up beyond the tables."""

MOST_SQUARE = 1e-3 / float(np.finfo(np.float64).eps)
"""A path has run away if its residuals' squares, over the noise, sum to more: what the columns explain of them is known
within their rounding only, and a law of drag -5 /s had the log likelihood 1.7e23
(`pytest tests/unit/diagnosis/test_breakaway_steep.py` has such paths)."""


def log_likelihoods(tried: Array, rows: Any, laws: Laws) -> Array:
    """Returns the log likelihood (r, k) of each moment `tried` (r, k), s, without place (flat prior), creep and D."""
    out = np.empty(tried.shape)
    _fill(tried, rows, laws, Along.nothing(laws), out)
    return out


@compiled
def _fill(tried: Any, rows: Any, laws: Any, along: Any, out: Any) -> None:
    crept, shot = np.empty(rows.time_s.shape[1]), room(tried.shape[1], 0, rows.time_s.shape[1])
    for run in range(tried.shape[0]):
        size = rows.count[run]
        shoot(rows, run, tried[run], laws, along, shot)
        for m in range(tried.shape[1]):
            left, bent = shot.ways[m, 0], shot.bends[m, 0]
            columns(rows, run, shot.begin[m], laws, left, bent, crept)
            out[run, m] = marginal(left, crept, bent, size) - size * np.log(rows.sigma_m[run])


@compiled
def columns(rows: Any, run: int, begin: int, laws: Any, left: Any, slope: Any, crept: Any) -> None:
    """Writes the creep's column, and makes of a path and its slope by D the residuals and D's column, over the noise.

    `begin` is the first frame after the release.
    """
    per_m, path, sine = 1.0 / rows.sigma_m[run], rows.path_m[run], rows.sine[run]
    creep, spread, from_sine = laws.creep_m * per_m, laws.spread * per_m, 1.0 / sine[begin]
    for i in range(rows.count[run]):
        crept[i] = creep * min(sine[i] * from_sine - 1.0, 0.0) if i < begin else 0.0
        slope[i] *= spread
        left[i] = (path[i] - left[i]) * per_m


@compiled
def marginal(value: Any, one: Any, two: Any, size: int) -> float:
    """Returns the log likelihood of values (n,): a level, Gaussians times columns `one` and `two`, and unit noise.

    It is UNLIKELY where values or columns are too large for it.
    """
    level = mean_one = mean_two = 0.0
    for i in range(size):
        level += value[i]
        mean_one += one[i]
        mean_two += two[i]
    level, mean_one, mean_two = level / size, mean_one / size, mean_two / size
    square = at_one = at_two = one_two = 0.0
    one_one = two_two = 1.0
    for i in range(size):
        left, first, second = value[i] - level, one[i] - mean_one, two[i] - mean_two
        square += left * left
        at_one += first * left
        at_two += second * left
        one_one += first * first
        one_two += first * second
        two_two += second * second
    volume = one_one * two_two - one_two * one_two
    explained = (two_two * at_one * at_one - 2.0 * one_two * at_one * at_two + one_one * at_two * at_two) / volume
    found = -0.5 * (square - explained + np.log(volume))
    return found if np.isfinite(found) and square < MOST_SQUARE else UNLIKELY
