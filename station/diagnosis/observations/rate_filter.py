"""The filter of an arm's rates, undone by the readings of the attitude.

A driver may smooth its rates by any linear filter: a mean over some time, a lag of first order, or several in a row. If
x'(t) is what recorded rates make of the attitude's motion, the attitude is then their integral and sum over k of b_k
x'(t + k h), with readings h apart. For a lag of first order b_0 is its time constant and the others are 0; moments of
the filter's delays, which are an expansion in slow motions, would miss a wrist that rings as fast as the filter.

The b are the regression (Wiener 1949, Extrapolation, Interpolation, and Smoothing of Stationary Time Series) of the
attitude's prediction errors on those of x'. Their prior is normal with mean 0 and the variance that makes the recording
most likely (empirical Bayes: Morris 1983, J. Am. Stat. Assoc. 78, 47): what few motions do not tell stays at 0.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import toeplitz
from scipy.optimize import minimize_scalar
from scipy.signal import oaconvolve

from station.physics.contact import Array

REACH_S = 0.1
"""The longest time by which a rate tells of the attitude before or after it: drivers smooth over less."""

LEAST_SHARE = 1e-12
"""Combinations of shifted rates with a smaller share of the largest one's square are rounding."""

LOG_RATIOS = (-10.0, 60.0)
"""Bounds of the log of the prior's variance, in units of the best known combination's error."""


def weights(missed: Array, shifted: Array, step_s: float) -> Array:
    """Returns the weights b (2 K + 1,), s, with readings `step_s` apart.

    K steps are REACH_S, or a quarter of the readings.

    Args:
        missed: (n, 2) prediction errors of the attitude less the rates' integral.
        shifted: (n, 2) those of x'.
        step_s: time between two readings.
    """
    reach = max(1, min(round(REACH_S / step_s), len(missed) // 4))
    own = np.array([_lagged(shifted, shifted, lag) for lag in range(2 * reach + 1)])
    both = np.array([_lagged(missed, shifted, lag) for lag in range(-reach, reach + 1)])
    if not own[0] > 0.0:
        return np.zeros(2 * reach + 1)
    size, axes = np.linalg.eigh(toeplitz(own))
    known = size > LEAST_SHARE * size[-1]
    size, axes = size[known], axes[:, known]
    along = axes.T @ both
    left = (float((missed * missed).sum()) - float((along**2 / size).sum())) / missed.size
    return axes @ (along / size * _trust(along**2 / (size * max(left, 1e-30)), size / size[-1]))


def answered(slope: Array, weight: Array, parts: Sequence[slice]) -> Array:
    """Returns the sums (n, 2) of b_k x'(t + k h); beyond its ends a part goes on as there.

    Args:
        slope: (n, 2) x', 1/s.
        weight: (w,) the 2 K + 1 weights b, s.
        parts: the stretches of readings without a gap.
    """
    reach = len(weight) // 2
    found = np.zeros_like(slope)
    for part in parts:
        wide = np.pad(slope[part], ((reach, reach), (0, 0)), mode="edge")
        found[part] = oaconvolve(wide, weight[::-1, None], mode="valid", axes=0)
    return found


def _lagged(one: Array, other: Array, lag: int) -> float:
    """Returns the sum over t of one(t) other(t + lag), both (n, 2)."""
    early, late = (one, other) if lag >= 0 else (other, one)
    count = len(one) - abs(lag)
    return float((early[:count] * late[len(one) - count :]).sum())


def _trust(square: Array, size: Array) -> Array:
    """Gives the shares (m,) of the regression's combinations that are kept, by their squares in units of their errors'.

    A combination of information `size` (m,), relative to the largest, has the square 1 + v size on average, v being the
    prior's variance.
    """

    def unlikely(log_ratio: float) -> float:
        expected = 1.0 + np.exp(log_ratio) * size
        return float((np.log(expected) + square / expected).sum())

    found = minimize_scalar(unlikely, bounds=LOG_RATIOS, method="bounded")
    ratio = np.exp(found.x) * size
    return ratio / (1.0 + ratio)
