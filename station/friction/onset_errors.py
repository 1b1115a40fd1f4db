"""The errors of a slide's frames, estimated from the residuals of its fit: noise, jitter of stamps, misspecification.

Whatever the fit does not allow for shows in the residuals of the slide: most frames show a block at rest, and tell the
noise alone. A stamp that jitters puts its frame off by the block's speed, so that the last frames, which decide most,
err most. Residuals that are larger still say that the law or the tilt is misspecified: the onset's error grows by their
ratio to what is expected (Birge), and those that resemble their neighbours count for fewer.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from station.friction.onset_loads import Array

_JITTER_S = np.append(0.0, np.geomspace(1e-6, 0.1, 200))
"""The jitters that are tried: neighbours differ by 6 %. Less than a microsecond moves no block by its noise, and with
more than a tenth of a second there is no order in the frames of a slide (`pytest tests/unit/friction -k jitter`)."""
_MOST_ALIKE = 0.95
"""The largest correlation of neighbours that a slide's residuals tell: they are some 20, which is half of a wave."""


@dataclass(frozen=True, slots=True)
class Residuals:
    """Residuals (n,), m, of frames in a fit, with the block's speed (n,), m/s, and the fit's slope (n,), m/rad.

    `taken` (n,) is the share of a frame's error that the fit follows; `moving` (n,) tells if the block slides.
    """

    residual_m: Array
    speed_m_s: Array
    slope: Array
    taken: Array
    moving: NDArray[np.bool_]

    def error_m(self, sigma_m: float) -> float:
        """Returns the standard deviation of one frame's error, m: the mean over frames as far as the slope needs them.

        `sigma_m` is the noise of a frame as measured before, m; at rest it may prove to be larger.
        """
        noise = self._noise_m(sigma_m)
        variance = noise**2 + (self._jitter_s(noise) * self.speed_m_s) ** 2
        weight = self.slope**2 / max(float(self.slope @ self.slope), 1e-30)
        return math.sqrt(float(weight @ variance) * self._excess(variance, weight))

    def _noise_m(self, sigma_m: float) -> float:
        rest = ~self.moving
        free = max(float((1.0 - self.taken[rest]).sum()), 1.0)
        return max(sigma_m, math.sqrt(float((self.residual_m[rest] ** 2).sum()) / free))

    def _jitter_s(self, noise_m: float) -> float:
        """Returns the least jitter, s, by which the slide's residuals are as large as expected (Mandel and Paule)."""
        residual, speed = self.residual_m[self.moving], self.speed_m_s[self.moving]
        expected = float((1.0 - self.taken[self.moving]).sum())
        chi2 = (residual**2 / (noise_m**2 + (_JITTER_S[:, None] * speed) ** 2)).sum(axis=1)
        return float(_JITTER_S[min(int(np.searchsorted(-chi2, -expected)), len(_JITTER_S) - 1)])

    def _excess(self, variance: Array, weight: Array) -> float:
        """Returns by which factor the squares of the residuals that decide are larger than expected; 1 or more."""
        expected = max(float(weight @ (variance * (1.0 - self.taken))), 1e-30)
        return max(1.0, self._alike() * float(weight @ self.residual_m**2) / expected)

    def _alike(self) -> float:
        """Returns how many residuals say as much as one that has nothing of its neighbours (autoregression)."""
        weighed = np.abs(self.slope) * self.residual_m
        correlation = float(weighed[1:] @ weighed[:-1]) / max(float(weighed @ weighed), 1e-30)
        correlation = min(max(correlation, 0.0), _MOST_ALIKE)
        return (1.0 + correlation) / (1.0 - correlation)
