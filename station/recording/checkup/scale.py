"""Holds the mark's side in the samples' references against the plate's scale: each is a witness of the other."""

from __future__ import annotations

import math
from dataclasses import dataclass

from shared.foxglove import CameraCalibration
from shared.geometry import straightened
from shared.messages import CameraGeometry, Sample
from station.recording.reader import Recorded
from station.signals.mark_side import IMPOSSIBLE, contradiction

TOPICS = frozenset({"camera/geometry", "camera/calibration", "session/sample"})


@dataclass(frozen=True, kw_only=True)
class ScaleHealth:
    """The largest share by which the mark's side contradicts the plate's scale, in a run's reference, and that run.

    `impossible` are the runs in which it is more than printing explains.
    """

    off: float = 0.0
    run: int = 0
    impossible: tuple[int, ...] = ()


class ScaleWatch:
    """Collects what `ScaleHealth` says."""

    def __init__(self) -> None:
        self._geometry: CameraGeometry | None = None
        self._lens: CameraCalibration | None = None
        self._off: dict[int, float] = {}

    def add(self, item: Recorded) -> None:
        """Takes the next message of `TOPICS`; a sample is judged by the calibration before it."""
        message = item.message
        if isinstance(message, CameraGeometry):
            self._geometry = message.if_calibrated()
        elif isinstance(message, CameraCalibration):
            self._lens = message
        elif isinstance(message, Sample) and self._geometry is not None:
            self._take(message, self._geometry)

    def _take(self, sample: Sample, geometry: CameraGeometry) -> None:
        """Takes a run's reference, unless no corner or no side is known; a mark on the horizon is off by all of it."""
        if sample.reference_corners_px and geometry.marker_side_m > 0.0:
            off = contradiction(straightened(sample.reference_corners_px, self._lens), geometry)
            self._off[sample.run] = 1.0 if math.isnan(off) else off

    def health(self) -> ScaleHealth:
        """Returns the findings of the messages so far."""
        run = max(self._off, key=lambda one: self._off[one], default=0)
        impossible = tuple(one for one, off in self._off.items() if not off <= IMPOSSIBLE)
        return ScaleHealth(off=self._off.get(run, 0.0), run=run, impossible=impossible)
