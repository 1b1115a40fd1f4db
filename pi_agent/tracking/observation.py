"""Holds what the tracker says about one frame."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Observation:
    """The mark in one frame.

    `corners_px`: (4, 2) by identity, clockwise as seen; NaN when there are none. `sigma_px`: standard deviation of one
    coordinate of a corner. `residual_px`: RMS distance of the edge points from their lines. `corner_dt_ns`:
    mid-exposure of each corner's row after the capture time. `reason`: why there is no mark, or that it tips.
    `tip_rad`: lean told by foreshortening, 0 below what can be told; above 0 the corners are where they are seen, but
    must not be taken for motion in the plate's plane. `identity`: "marked" (read from the mark), "continuous"
    (followed since it was first seen), "assumed" (a plain square after a dropout: right modulo a quarter turn), or ""
    when not found.
    """

    capture_ns: int
    found: bool
    reason: str
    corners_px: NDArray[np.float64]
    sigma_px: float = float("nan")
    residual_px: float = float("nan")
    corner_dt_ns: tuple[int, int, int, int] = (0, 0, 0, 0)
    identity: str = ""
    tip_rad: float = 0.0

    @staticmethod
    def missing(capture_ns: int, reason: str) -> "Observation":
        """Returns no mark in this frame, and why."""
        return Observation(capture_ns, False, reason, np.full((4, 2), np.nan))
