"""Follows the reference position from the messages, as the sampling logic takes it."""

from __future__ import annotations

import numpy as np

from shared.geometry import Array
from shared.messages import MarkerCorners, RunEvent, Sample

_ENDS = ("LEVEL", "DWELL", "DONE", "ABORTED")
_INCIDENTAL = ("STEP_BEGIN", "STEP_END", "SYNC")


class ReferenceTracker:
    """The corners before the tilt: the mean of those seen in the phase REFERENCE, until the run is over.

    The station's own reference stands in the sample, which comes only after the slip; until then this mean, which may
    hold a few frames more, takes its place.
    """

    def __init__(self) -> None:
        self.corners_px: Array | None = None
        self._sum = np.zeros((4, 2))
        self._count = 0
        self._phase = ""

    def on_event(self, event: RunEvent) -> None:
        """Takes the phase that began."""
        if event.phase in _INCIDENTAL:
            return
        if event.phase == "REFERENCE":
            self._sum, self._count = np.zeros((4, 2)), 0
        if event.phase in _ENDS:
            self.corners_px = None
        self._phase = event.phase

    def on_corners(self, corners: MarkerCorners) -> None:
        """Takes the corners of a frame."""
        if self._phase == "REFERENCE" and corners.found:
            self._sum += np.reshape(corners.corners_px, (4, 2))
            self._count += 1
            self.corners_px = self._sum / self._count

    def on_sample(self, sample: Sample) -> None:
        """Takes the run's result."""
        if self.corners_px is not None and len(sample.reference_corners_px) == 8:
            self.corners_px = np.reshape(np.array(sample.reference_corners_px), (4, 2))
