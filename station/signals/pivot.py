"""The acceleration of the tilts' fixed point, which in a real arm is not quite fixed, from its recorded places.

A pivot that strays by tenths of a millimetre within a tenth of a second is accelerated by tenths of a m/s², which is
some per cent of a block's friction. The acceleration is the curvature of a parabola through neighbouring places
(Savitzky and Golay 1964, Anal. Chem. 36, 1627), through the fewest places that keep the readings' noise out of it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_coeffs, savgol_filter
from scipy.spatial.transform import Rotation

from shared.geometry import Array
from station.signals.tracks import AttitudeTrack

QUIET_M_S2 = 0.02
"""The largest noise of the acceleration: half a per cent of the friction at mu = 0.4.

tests/unit/signals/test_pivot.py shows what it keeps in and out.
"""

WIDTHS = (3, 5, 9, 17, 33)
"""Readings per parabola, the fewest first: at 100 readings a second they are 20 ms to 0.3 s, which is a step of tilt.
"""

_FOURTH_DIFFERENCE, _MAD_PER_SD = float(np.sqrt(70.0)), 0.6745
"""The sd of a fourth difference of unit white noise, and the median absolute deviation of a unit Gaussian."""

MOST_PLACES = 5_000_000
"""Evenly spaced places that fit into memory: 14 h at 100 readings a second."""

Acceleration = Callable[[Array], Array]


def pivot_in_plate(known: AttitudeTrack, time_s: Array) -> Array | None:
    """Returns the pivot's acceleration (n, 3) in P, m/s², at readings at times `time_s` (n,), s.

    It is None where it is not known.
    """
    acceleration = pivot_acceleration(time_s, known.pivot_m)
    if acceleration is None:
        return None
    world_from_plate = Rotation.from_quat(known.quaternion, scalar_first=True)
    return np.asarray(world_from_plate.apply(acceleration(time_s), inverse=True))


def pivot_acceleration(time_s: Array, pivot_m: Array) -> Acceleration | None:
    """Gives the function that interpolates the pivot's acceleration in the world: from times (m,), s, to (m, 3), m/s².

    It is None if the recording has no places of the pivot, if they do not change, if they are too noisy, or if they
    are so far apart in time that evenly spaced ones would not fit into memory.

    Args:
        time_s: (n,) times of the readings, increasing.
        pivot_m: (n, 3) places in the world, nan where unknown.
    """
    if len(time_s) < max(WIDTHS) or not np.isfinite(pivot_m).all() or not np.ptp(pivot_m, axis=0).any():
        return None
    step_s = float(np.median(np.diff(time_s)))
    if time_s[-1] - time_s[0] > MOST_PLACES * step_s:
        return None
    even_s = np.arange(time_s[0], time_s[-1], step_s)
    places = np.asarray(CubicSpline(time_s, pivot_m)(even_s))
    noise_m = float(np.median(np.abs(np.diff(pivot_m, 4, axis=0)), axis=0).max()) / _MAD_PER_SD / _FOURTH_DIFFERENCE
    for width in WIDTHS:
        curvature = savgol_coeffs(width, 2, deriv=2, delta=step_s)
        if noise_m * float(np.linalg.norm(curvature)) <= QUIET_M_S2:
            found = np.asarray(savgol_filter(places, width, 2, deriv=2, delta=step_s, axis=0))
            return lambda at: np.column_stack([np.interp(at, even_s, column) for column in found.T])
    return None
