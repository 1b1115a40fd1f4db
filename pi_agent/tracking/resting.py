"""A block that rests does not change its shape: what differs from the last frames was done to the picture.

A finger, a highlight or the edge of a shadow can move one edge of the outline without breaking it. While the mark stays
where it is, light and lens give every frame the same outline, and even a small departure tells. Once it has moved by
some pixels the lens and the plate's grain may change the outline as well: it is learned anew at the new place.
"""

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.complex128]

NEAR_PX = 3.0  # within this distance lens and grain change an outline by less than is told here
LEAST_SHARE = 0.1  # of the newest frame in the outline that is remembered
SYSTEMATIC_PX = 0.03  # departures that sampling and grain may cause
NOISE_PX = 1.2  # deviation of a corner's coordinate by pixel noise, times the contrast (of 255)
DEVIATIONS = 4.0


class RestingShape:
    """The mark's outline while it rests, about its centre."""

    def __init__(self) -> None:
        self._arms: Points | None = None
        self._place = 0j
        self._frames = 0

    def departure_px(self, corners: Points) -> float | None:
        """Largest distance of a corner (4,) from the outline, moved and turned onto it; None away from its place."""
        centre = complex(corners.sum()) / 4
        if self._arms is None or abs(centre - self._place) > NEAR_PX:
            return None
        return float(np.abs(self._turned(corners - centre) - self._arms).max())

    def limit_px(self, contrast: float) -> float:
        """The largest departure that pixel noise and sampling explain."""
        noise = NOISE_PX / contrast * float(np.sqrt(1.0 + 1.0 / max(self._frames, 1)))
        return SYSTEMATIC_PX + DEVIATIONS * noise

    def learn(self, corners: Points) -> None:
        """Takes the corners of a frame that was believed."""
        centre = complex(corners.sum()) / 4
        arms = corners - centre
        if self._arms is None or abs(centre - self._place) > NEAR_PX:
            self._arms, self._place, self._frames = arms, centre, 1
            return
        self._frames += 1
        self._arms = self._arms + max(1.0 / self._frames, LEAST_SHARE) * (self._turned(arms) - self._arms)

    def _turned(self, arms: Points) -> Points:
        turn = complex(np.vdot(arms, self._arms)) if self._arms is not None else 1.0 + 0j
        return arms * (turn / max(abs(turn), 1e-9))
