"""Traces a slide back to its onset with a function that is handed over: what records or simulates measures nothing."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Traced = Callable[..., Any]
"""`station.friction.onset.estimate_onset`."""

FITTED_NS = 3_000_000_000
"""The stretch of path before the detection that is fitted, as on the rig."""
LEAST_SIGMA_M = 1e-6
"""The noise of a simulated track, which has none: an onset's fit divides by it."""
LEAST_ALONG = 0.2
"""The least cosine between slide and downhill in the fit, which divides by it."""


def trace(
    onset: Traced,
    time_ns: ArrayLike,
    place_m: NDArray[np.float64],
    *,
    start_m: NDArray[np.float64],
    down: ArrayLike,
    tilt_ns: ArrayLike,
    tilt_rad: ArrayLike,
    sigma_m: float,
    clock_sigma_s: float = 0.0,
    scale_sigma: float = 0.0,
) -> Any:
    """Returns the onset that is read in a slide; None where it cannot be, or the block has not moved.

    Args:
        onset: reads it.
        time_ns: (n,) the times of the frames up to the detection, ns.
        place_m: (n, 2) where the block then was in P, m.
        start_m: (2,) where it lay before, m in P.
        down: (2,) unit vector of the steepest descent at the detection, in P.
        tilt_ns: (m,) the times of the attitude's readings, ns.
        tilt_rad: (m,) their tilt, rad.
        sigma_m: the standard deviation of one displacement, m.
        clock_sigma_s: that of the frames' times against those of the readings, s.
        scale_sigma: that of the places' scale, as a share of it.
    """
    slide, downhill = place_m[-1] - start_m, np.asarray(down, dtype=np.float64)
    length = float(np.linalg.norm(slide))
    if length == 0.0 or not math.isfinite(length):
        return None
    way = slide / length
    return onset(
        time_ns,
        (place_m - start_m) @ way,
        tilt_ns=tilt_ns,
        tilt_rad=tilt_rad,
        sigma_m=sigma_m,
        along=max(LEAST_ALONG, float(way @ downhill)),
        ahead_m=float(start_m @ downhill),
        clock_sigma_s=clock_sigma_s,
        scale_sigma=scale_sigma,
    )
