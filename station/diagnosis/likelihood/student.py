"""Student's t for whitened components, and the censored Gaussian for runs that ended without a slide."""

from __future__ import annotations

import numpy as np
from scipy.special import gammaln, log_ndtr

from station.diagnosis import thresholds
from station.diagnosis.likelihood.noise import TAILS
from station.physics.contact import Array, Bools

SETTLED = 1e-7
"""The relative change of a scale at which its iteration ends; a smaller one changes no printed standard error."""


def log_density(white: Array, tail: Array, limit: Bools) -> Array:
    """Returns the log density (n,) of each component; for a limit, the log probability to lie beyond it.

    Args:
        white: (n,) the components, whitened and so without a unit.
        tail: (n,) their degrees of freedom, or one number for all.
        limit: (n,) True for limits.
    """
    square = white**2
    gauss = -0.5 * square - 0.5 * np.log(2 * np.pi)
    density = np.where(tail >= thresholds.GAUSSIAN, gauss, _volume(tail) - 0.5 * (tail + 1) * np.log1p(square / tail))
    density[limit] = log_ndtr(-white[limit])
    return density


def _volume(tail: Array) -> Array:
    """Returns the log of Student's density at 0, without its scale."""
    return gammaln((tail + 1) / 2) - gammaln(tail / 2) - 0.5 * np.log(tail * np.pi)


def pulls(white: Array, tail: Array, limit: Bools) -> tuple[Array, Array]:
    """Returns the slope (n,) of −log density by each component, and its weight (n,) in a Newton step.

    The weight is (ν + 1) / (ν + w²), as in iteratively reweighted least squares: unlike the curvature it is positive
    everywhere. For a limit it is the curvature itself.

    Args:
        white: (n,) the components, whitened and so without a unit.
        tail: (n,) their degrees of freedom, or one number for all.
        limit: (n,) True for limits.
    """
    curvature = np.where(tail >= thresholds.GAUSSIAN, 1.0, (tail + 1) / (tail + white**2))
    slope = curvature * white
    held = white[limit]
    # This is a Gaussian's hazard without overflow far in the tail.
    slope[limit] = hazard = np.exp(-0.5 * held**2 - 0.5 * np.log(2 * np.pi) - log_ndtr(-held))
    curvature[limit] = np.maximum(hazard * (hazard - held), 1e-9)
    return slope, curvature


def expected_information(curvature: Array, tail: Array, limit: Bools) -> Array:
    """Returns the information (n,) of each component, without a unit, about its own place: (ν + 1) / (ν + 3).

    A limit has its curvature: one that lies far below tells nothing (Lange, Little & Taylor 1989, J. Am. Stat. Assoc.
    84, 881, appendix B).

    Args:
        curvature: (n,) the weight that `pulls` gives.
        tail: (n,) the components' degrees of freedom, or one number for all.
        limit: (n,) True for limits.
    """
    expected = np.where(tail >= thresholds.GAUSSIAN, 1.0, (tail + 1.0) / (tail + 3.0))
    return np.where(limit, curvature, expected)


def fitted_tail(white: Array) -> tuple[float, float]:
    """Gives the degrees of freedom, out of TAILS, and the scale that fit the whitened components `white` (n,) best."""
    if len(white) < thresholds.LEAST_SCALED:
        return thresholds.GAUSSIAN, 1.0
    best, none = (-np.inf, thresholds.GAUSSIAN, 1.0), np.zeros(len(white), dtype=np.bool_)
    for tail in TAILS:
        scale = scale_of(white, tail)
        total = float(np.sum(log_density(white / scale, np.array(tail), none)) - len(white) * np.log(scale))
        best = max(best, (total, tail, scale))
    return best[1], best[2]


def scale_of(white: Array, tail: float) -> float:
    """Returns the likeliest scale for given degrees of freedom, from the median on; 1 for fewer than LEAST_SCALED.

    `white` (n,) are whitened components, without a unit.
    """
    if len(white) < thresholds.LEAST_SCALED:
        return 1.0
    scale = max(1.4826 * float(np.median(np.abs(white))), 1e-6)
    square = white**2
    for _ in range(30):
        before = scale
        weight = np.ones_like(square) if tail >= thresholds.GAUSSIAN else (tail + 1) / (tail + square / scale**2)
        scale = max(float(np.sqrt(weight @ square / len(square))), 1e-9)
        if abs(scale - before) < SETTLED * scale:
            break
    return scale
