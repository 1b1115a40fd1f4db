"""The tables of `breakaway`'s compiled kernels: laws of sliding and their slopes, and the runs whose paths are shot."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from station.physics.contact import Array

STEP_S = 4e-3

ROOT, COUNT = 6e-3, 112
SPEEDS_M_S: Array = np.square(ROOT * np.arange(COUNT))
"""Laws are tabulated at these speeds: finely where blocks break away, and up to 0.44 m/s."""


class Laws(NamedTuple):
    """Laws of sliding friction (g, COUNT - 1, 4), as cubics between SPEEDS_M_S; each run (r,) follows one of them."""

    held: Array
    """Ratio of sliding to static friction."""
    slowing_m_s2: Array
    of_run: Any
    spread: float
    """Standard deviation of the runs' random effects on `held`."""
    creep_m: float
    """Standard deviation of the creep before the slip, per relative rise of the tilt's sine."""


class Along(NamedTuple):
    """The slopes (q, g, COUNT - 1, 4) of the cubics of `Laws` by q numbers."""

    held: Array
    slowing_m_s2: Array

    @classmethod
    def nothing(cls, laws: Laws) -> Along:
        """Returns the slopes by no number."""
        none = np.zeros((0, *laws.held.shape))
        return cls(none, none)


def cubics(table: Array) -> Array:
    """Returns the cubics (…, COUNT - 1, 4) through a table, by powers of the speed beyond their interval's lower end.

    `table` (…, n) has the values at the n = COUNT speeds SPEEDS_M_S, in a unit of its own. The cubics' slopes are
    continuous (Fritsch & Carlson 1980, SIAM J. Numer. Anal. 17, 238, eq. 1). A path's slope by D follows the law's own
    slope: where that jumps from interval to interval, the likelihood is a staircase.
    """
    width, rise = np.diff(SPEEDS_M_S), np.diff(table)
    slope = np.gradient(table, SPEEDS_M_S, axis=-1, edge_order=2)
    first, last, mean = slope[..., :-1], slope[..., 1:], rise / width
    bend, twist = 3.0 * mean - 2.0 * first - last, first + last - 2.0 * mean
    return np.stack([table[..., :-1], first, bend / width, twist / width**2], axis=-1)


class Rows(NamedTuple):
    """Runs (r,), each row padded: pull and press, m/s², on even grids of STEP_S (r, m), and the frames (r, n)."""

    first_s: Array
    pull: Array
    press: Array
    count: Any
    """Number of frames (r,)."""
    time_s: Array
    path_m: Array
    sine: Array
    """Sine of the plate's tilt at the frames (r, n)."""
    sigma_m: Array
