"""Robust alternatives to the paper's filters, shown beside them.

A mean and a standard deviation are drawn towards the very slides that they are to find, so that a few gross errors
hide each other. The median and the MAD are not, nor is the covariance of Maronna and Zamar (2002), the orthogonalised
Gnanadesikan-Kettenring estimate, which looks at all features of a slide together. The thresholds are the paper's three
standard deviations in probability (0.27 % of regular slides, which are taken to be normal).
"""

from __future__ import annotations

import math
from typing import cast

import numpy as np
from scipy.special import chdtri

from station.friction.direction import Array
from station.friction.filters import DISTANCE_PX, ROUNDING, SIGMAS, Flags, Opening, touching
from station.friction.slides import Bools, Slides

TAIL = math.erfc(SIGMAS / math.sqrt(2))
MAD_TO_SD = 1.482602218505602
ALTERNATIVES = ("angle_mad", "circumference_mad", "multivariate", "leaning")


def robust_flags(slides: Slides, *, opening: Opening | None = None) -> Flags:
    """Returns the flags by the alternatives.

    `angle_mad` and `circumference_mad` stand for the paper's angle and circumference; `multivariate` looks at theta,
    distance and both circumferences together; `leaning` is every block that touched the foam before it slid, which
    is more than the paper's border: compressed foam pushes the block, wherever it goes.
    """
    opening = opening or Opening()
    slid, around = ~slides.censored, slides.circumference_px
    known = slid & np.isfinite(around).all(axis=1) & (slides.distance_px > 0)
    placed = slid & np.isfinite(slides.pre_m).all(axis=(1, 2))
    before = slides.pre_m - np.array([opening.x_m, opening.y_m])
    return Flags(
        by_filter={
            "angle_mad": _far_from_median(slides.theta_rad, slid),
            "circumference_mad": np.logical_or.reduce(_far_from_median(around, known[:, None]), axis=1),
            "multivariate": _outlying(slides, known),
            "leaning": placed & touching(before, opening.radius_m),
        },
        applicable={"angle_mad": slid, "circumference_mad": known, "multivariate": known, "leaning": placed},
        slid=slid,
    )


def _far_from_median(values: Array, counted: Bools) -> Bools:
    counted = np.broadcast_to(counted, values.shape)
    if counted.sum() < 2:
        return np.zeros(values.shape, dtype=bool)
    middle, spread = _median_and_mad(values[counted])
    # When more than half of the values are equal the MAD says nothing about the others.
    return counted & (np.abs(values - middle) > SIGMAS * spread) & (spread > ROUNDING * abs(middle))


def _median_and_mad(values: Array) -> tuple[float, float]:
    middle = float(np.median(values))
    return middle, MAD_TO_SD * float(np.median(np.abs(values - middle)))


def _outlying(slides: Slides, known: Bools) -> Bools:
    before, after = slides.circumference_px[known].T
    # Long slides are all alike; a logarithm above the paper's limit would call them outlying, so distances saturate.
    distance = np.minimum(slides.distance_px[known], 3 * DISTANCE_PX)
    features = np.column_stack([np.log(slides.theta_rad[known]), distance, before + after, after - before])
    flagged = np.zeros(len(slides), dtype=bool)
    # A feature that hardly varies (every slide long, say) has no scale to be outlying on.
    varied = features[:, [_median_and_mad(column)[1] > 1e-9 for column in features.T] if len(features) else []]
    if varied.shape[1] and len(varied) > 4 * varied.shape[1]:
        flagged[known] = robust_distance2(varied) > _chi2_beyond(TAIL, varied.shape[1])
    return flagged


def robust_distance2(points: Array) -> Array:
    """Gives squared Mahalanobis distances (n,) of points (n, p) by the orthogonalised Gnanadesikan-Kettenring estimate.

    Like the MCD it is scaled so that the median distance is that of normal data.
    """
    scale = np.array([_median_and_mad(column)[1] for column in points.T])
    scaled = points / scale
    size = points.shape[1]
    correlation = np.eye(size)
    for i in range(size):
        for j in range(i):
            plus = _median_and_mad(scaled[:, i] + scaled[:, j])[1]
            minus = _median_and_mad(scaled[:, i] - scaled[:, j])[1]
            correlation[i, j] = correlation[j, i] = (plus**2 - minus**2) / 4
    rotated = scaled @ np.linalg.eigh(correlation)[1]
    distance2 = np.zeros(len(points))
    for column in rotated.T:
        middle, spread = _median_and_mad(column)
        distance2 += ((column - middle) / max(spread, 1e-12)) ** 2
    return cast(Array, distance2 * _chi2_beyond(0.5, size) / float(np.median(distance2)))


def _chi2_beyond(tail: float, df: int) -> float:
    """Returns the value that chi-squared with `df` degrees of freedom exceeds with the probability `tail`."""
    return float(chdtri(df, tail))
