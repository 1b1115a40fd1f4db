"""The white noise of an arm's recorded rates, taken out as far as the motion lets it.

An acceleration is a difference of rates, so noise of 1 mrad/s at 100 Hz is .2 rad/s^2 of it, and a plate that turns
about a point far off shakes its block by that. The rates are smoothed as Whittaker does (1923, Proceedings of the
Edinburgh Mathematical Society 41, 63): least squares to what was recorded and, times a penalty, to differences of
order ORDER that are zero. It is linear and leaves polynomials below that order alone. The penalty is the one with the
least expected error of the rates' steps by Mallows' C_p (1973, Technometrics 15, 661) over the readings at which the
plate is accelerated: where it rests, any penalty does. Rates without noise stay as they are.
"""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded
from scipy.ndimage import uniform_filter1d
from scipy.optimize import minimize_scalar

from station.physics.contact import Array

ORDER = 4
"""With 5 mrad/s of noise the accelerations of a ringing arm err by .30 rad/s^2 with 4 or 3, by .35 with 2, and by
.59 as they are (`pytest -s tests/unit/diagnosis/test_rate_noise.py` prints it)."""
CLEAR, WINDOW = 4.0, 11
"""The plate is accelerated where the mean square of WINDOW steps of the rates (0.1 s) is CLEAR times that of the noise;
half as much or twice as much changes the accelerations' error by a hundredth
(`pytest -s tests/unit/diagnosis/test_rate_noise.py -k accelerated` prints it)."""
STRETCH, QUIET, OF_NOISE = 10, 0.1, 0.542
"""The plate rests in one of ten stretches of 10 readings (0.1 s): it dwells for longer in every run. Of noise alone the
quantile QUIET of the stretches' mean squares is OF_NOISE times their mean (by 200 000 that were drawn)."""
LOG_PENALTIES = (-12.0, 8.0)
"""Bounds of the penalty's log: from nothing, to what leaves of 100 readings a second only what is slower than 6 Hz."""
ENOUGH = 200_000
"""The penalty is found by this many readings: more do not tell it better."""

_GAINS = 4096


def without_noise(rate_rad_s: Array) -> Array:
    """Returns `rate_rad_s` (n, 3), read at equal intervals, without its noise: rates (n, 3) in rad/s.

    Exact rates are returned as they are.
    """
    head = rate_rad_s[:ENOUGH]
    noise = resting_noise(head)
    if not noise > 0.0:
        return rate_rad_s
    moved = changing(head, noise)

    def error(log_penalty: float) -> float:
        left = np.diff(head - smoothed(head, np.exp(log_penalty)), axis=0)[moved[1:]]
        return float(np.square(left).mean()) + 2.0 * noise**2 * _gain_of_steps(np.exp(log_penalty))

    best = minimize_scalar(error, bounds=LOG_PENALTIES, method="bounded", options={"xatol": 0.1})
    as_it_is = 2.0 * noise**2 * _gain_of_steps(0.0)
    return smoothed(rate_rad_s, float(np.exp(best.x))) if best.fun < as_it_is else rate_rad_s


def resting_noise(values: Array) -> float:
    """Returns the noise's standard deviation by stretches in which the plate rests, in the unit of `values` (n, 3)."""
    if len(values) < STRETCH + ORDER:
        return 0.0
    size = sum(comb(ORDER, k) ** 2 for k in range(ORDER + 1))
    power = np.square(np.diff(values, n=ORDER, axis=0)).mean(axis=1) / size
    stretches = power[: len(power) // STRETCH * STRETCH].reshape(-1, STRETCH).mean(axis=1)
    return float(np.sqrt(np.quantile(stretches, QUIET) / OF_NOISE))


def changing(values: Array, noise: float) -> NDArray[np.bool_]:
    """Returns true (n,) for readings about which `values` (n, 3) change by more than noise; for all if none do.

    `noise` is their standard deviation, in the values' unit.
    """
    step = np.diff(values, axis=0, append=values[-1:])
    power = uniform_filter1d(np.square(step).sum(axis=1), WINDOW)
    clear = power > CLEAR * 2.0 * values.shape[1] * noise**2
    return np.asarray(clear if clear.any() else np.ones_like(clear))


def smoothed(values: Array, penalty: float) -> Array:
    """Returns the values (n, 3), in their own unit, that minimise the sum of both squares for given `values` (n, 3)."""
    return np.asarray(solveh_banded(_normal_equations(len(values), penalty), values))


def _normal_equations(count: int, penalty: float) -> Array:
    """Returns the upper bands (ORDER + 1, count) of I + penalty D'D, D being the differences of order ORDER."""
    weights = [(-1) ** k * comb(ORDER, k) for k in range(ORDER + 1)]
    bands = np.zeros((ORDER + 1, count))
    for apart in range(ORDER + 1):
        for k in range(ORDER + 1 - apart):
            bands[ORDER - apart, k + apart : k + apart + count - ORDER] += penalty * weights[k] * weights[k + apart]
    bands[ORDER] += 1.0
    return bands


def _gain_of_steps(penalty: float) -> float:
    """Returns how much of white noise of variance 1 is in the product of the steps before and after the smoothing."""
    return gain(penalty, steps=1)


def gain(penalty: float, *, steps: int = 0) -> float:
    """Returns how much of white noise of variance 1 is in the product of what was before the smoothing and after it.

    Of differences of the order `steps` that is the trace of D S D' by the number of readings, of which there are many,
    with D the differences and S the smoother.
    """
    step = 2.0 * np.sin((np.arange(_GAINS) + 0.5) / _GAINS * np.pi / 2.0)
    return float(np.mean(step ** (2 * steps) / (1.0 + penalty * step ** (2 * ORDER))))
