"""Student's t for whitened components, and the Gaussian limit for runs that ended without a slide."""

from __future__ import annotations

import numpy as np
from scipy.special import gammaln, log_ndtr

from station.diagnosis import thresholds
from station.diagnosis.likelihood.noise import TAILS
from station.physics.contact import Array, Bools


def log_density(white: Array, tail: Array, limit: Bools) -> Array:
    """Log density of each component; of a limit the log probability to be beyond it."""
    student = (
        gammaln((tail + 1) / 2)
        - gammaln(tail / 2)
        - 0.5 * np.log(tail * np.pi)
        - 0.5 * (tail + 1) * np.log1p(white**2 / tail)
    )
    gauss = -0.5 * white**2 - 0.5 * np.log(2 * np.pi)
    return np.where(limit, log_ndtr(-white), np.where(tail >= thresholds.GAUSSIAN, gauss, student))


def pulls(white: Array, tail: Array, limit: Bools) -> tuple[Array, Array]:
    """Slope and curvature of −log density by the component: what a Newton step needs."""
    weight = np.where(tail >= thresholds.GAUSSIAN, 1.0, (tail + 1) / (tail + white**2))
    # The hazard of a Gaussian, without overflow far in the tail.
    hazard = np.exp(-0.5 * white**2 - 0.5 * np.log(2 * np.pi) - log_ndtr(-white))
    slope = np.where(limit, hazard, weight * white)
    curvature = np.where(limit, np.maximum(hazard * (hazard - white), 1e-9), weight)
    return slope, curvature


def fitted_tail(white: Array) -> tuple[float, float]:
    """The degrees of freedom that fit components best, and the scale beside them."""
    if len(white) < 20:
        return thresholds.GAUSSIAN, 1.0
    best = (-np.inf, thresholds.GAUSSIAN, 1.0)
    for tail in TAILS:
        scale = _scale(white, tail)
        none = np.zeros(len(white), dtype=np.bool_)
        total = float(np.sum(log_density(white / scale, np.full(len(white), tail), none)) - len(white) * np.log(scale))
        best = max(best, (total, tail, scale))
    return best[1], best[2]


def _scale(white: Array, tail: float) -> float:
    """Maximum-likelihood scale at given tails, by iteration from the median."""
    scale = max(1.4826 * float(np.median(np.abs(white))), 1e-6)
    for _ in range(30):
        weight = 1.0 if tail >= thresholds.GAUSSIAN else (tail + 1) / (tail + (white / scale) ** 2)
        scale = max(float(np.sqrt(np.mean(weight * white**2))), 1e-9)
    return scale
