"""Cubics through values and slopes that are known at the same times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded

from station.physics.contact import Array

Indices = slice | NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Cubics:
    """Cubic Hermite interpolation of `values` (n, k) at rising times (n,), s.

    `slopes` makes the slopes (m, k) at some of the times. A session's coefficients would take several times the room
    of what they are made from, for as long as its evidence is kept.
    """

    time_s: Array
    values: Array
    slopes: Callable[[Indices], Array]

    def __call__(self, seconds: Array) -> Array:
        """Returns the values (m, k) at times (m,); beyond the ends the outermost cubics go on."""
        index, step, along = self._within(seconds)
        back = 1.0 - along
        ends = (
            back * back * (1.0 + 2.0 * along) * self.values[index]
            + along * along * (3.0 - 2.0 * along) * self.values[index + 1]
        )
        return ends + step * along * back * (back * self.slopes(index) - along * self.slopes(index + 1))

    def slope(self, seconds: Array) -> Array:
        """Returns the slopes (m, k), by the second, at times `seconds` (m,), s."""
        index, step, along = self._within(seconds)
        rise = (self.values[index + 1] - self.values[index]) / step
        first, last = self.slopes(index), self.slopes(index + 1)
        return first + along * (2.0 * (3.0 * rise - 2.0 * first - last) + along * 3.0 * (first + last - 2.0 * rise))

    def bends(self) -> Array:
        """Returns the second derivatives (n - 1, k) where each cubic begins."""
        step = np.diff(self.time_s)[:, None]
        rise = np.diff(self.values, axis=0) / step
        return 2.0 * (3.0 * rise - 2.0 * self.slopes(slice(None, -1)) - self.slopes(slice(1, None))) / step

    def _within(self, seconds: Array) -> tuple[NDArray[np.int64], Array, Array]:
        """Gives the cubic (m,) in which each time lies, its length (m, 1), and the share of it (m, 1) that has gone."""
        index = np.clip(np.searchsorted(self.time_s, seconds, side="right") - 1, 0, len(self.time_s) - 2)
        step = (self.time_s[index + 1] - self.time_s[index])[:, None]
        return index, step, (seconds - self.time_s[index])[:, None] / step


def spline_slopes(time_s: Array, values: Array) -> Array:
    """Returns the slopes (n, k) of the natural cubic spline through `values` (n, k) at times `time_s` (n,), s.

    The second derivative is continuous, and 0 at both ends (de Boor 2001, A Practical Guide to Splines, ch. 4).
    """
    if len(time_s) < 2:
        return np.zeros_like(values)
    step = np.diff(time_s)
    rise = np.diff(values, axis=0) / step[:, None]
    bands = np.zeros((3, len(time_s)))
    bands[0, 1], bands[0, 2:] = 1.0, step[:-1]
    bands[1, 0], bands[1, 1:-1], bands[1, -1] = 2.0, 2.0 * (step[1:] + step[:-1]), 2.0
    bands[2, :-2], bands[2, -2] = step[1:], 1.0
    right = np.empty_like(values)
    right[0], right[-1] = 3.0 * rise[0], 3.0 * rise[-1]
    right[1:-1] = 3.0 * (step[1:, None] * rise[:-1] + step[:-1, None] * rise[1:])
    return np.asarray(solve_banded((1, 1), bands, right, overwrite_ab=True, overwrite_b=True))


def spline_integral(time_s: Array, values: Array) -> Array:
    """Returns the integral (n, k) of the spline through `values` (n, k) from the first of `time_s` (n,), s, to each."""
    step = np.diff(time_s)[:, None]
    bent = step / 6.0 * np.diff(spline_slopes(time_s, values), axis=0)
    pieces = step / 2.0 * (values[1:] + values[:-1] - bent)
    return np.concatenate([np.zeros_like(values[:1]), np.cumsum(pieces, axis=0)])
