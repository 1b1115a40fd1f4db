"""A scatter with one peak, lopsided and long or short in its tails: the sinh-arcsinh distribution.

y = m + s sinh((asinh(z) + e) / d) with z normal: e leans it, d below 1 lengthens the tails and above 1 shortens them
(Jones & Pewsey 2009, Biometrika 96, 761). Scatters of friction are near it whatever they are: normal, with outliers,
multiplied by something that is never negative.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from station.diagnosis.likelihood.robust import GAUSSIAN_MAD
from station.physics.contact import Array

FARTHEST = np.array([3.0, 3.0, 3.0, 2.0])
"""The bounds of level and log scale (in robust sd), of the lean, and of the log of the tails' number."""

BEGINNINGS = (-0.7, 0.0, 0.5)
"""The logs of the tails' number at which fits begin: long tails, normal ones, and short ones, as flat scatters have."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OnePeak:
    """The distribution: its level, its scale, its lean, and the number of its tails."""

    level: float
    scale: float
    lean: float
    tails: float
    log_likelihood: float = -math.inf

    def drawn(self, count: int, rng: np.random.Generator) -> Array:
        """Returns values (count,) of this distribution."""
        return self.level + self.scale * np.sinh((np.arcsinh(rng.normal(size=count)) + self.lean) / self.tails)


def one_peak(values: Array) -> OnePeak:
    """Returns the likeliest distribution with one peak for values (n,)."""
    middle = float(np.median(values))
    scale = max(GAUSSIAN_MAD * float(np.median(np.abs(values - middle))), 1e-9)
    scaled = (values - middle) / scale
    fits = [_climbed(scaled, tails) for tails in BEGINNINGS]
    least, numbers = min(fits, key=lambda found: found[0])
    level, log_scale, lean, log_tails = numbers.tolist()
    return OnePeak(
        level=middle + scale * level,
        scale=scale * math.exp(log_scale),
        lean=lean,
        tails=math.exp(log_tails),
        log_likelihood=-least - len(values) * math.log(scale),
    )


def _climbed(scaled: Array, tails: float) -> tuple[float, Array]:
    """Returns -ln L and the four numbers at the maximum that is reached from a log of the tails' number."""
    begin, bounds = (0.0, 0.0, 0.0, tails), list(zip(-FARTHEST, FARTHEST, strict=True))
    found = minimize(_minus_log_likelihood, begin, args=(scaled,), method="L-BFGS-B", bounds=bounds)
    return float(found.fun), np.asarray(found.x)


def _minus_log_likelihood(numbers: Array, scaled: Array) -> float:
    level, log_scale, lean, log_tails = numbers.tolist()
    away, tails = (scaled - level) * math.exp(-log_scale), math.exp(log_tails)
    normal = np.sinh(tails * np.arcsinh(away) - lean)
    density = log_tails - log_scale + 0.5 * np.log1p(normal**2) - 0.5 * np.log1p(away**2) - 0.5 * normal**2
    return -float(density.sum()) + 0.5 * len(scaled) * math.log(2.0 * math.pi)
