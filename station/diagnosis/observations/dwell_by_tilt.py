"""The dwell at a given tilt, which the protocol chose whatever friction did.

A block that happens to hold longer also rests longer: by the time up to its own slip, friction would seem to grow with
the dwell. A model therefore asks for the dwell at the tilt at which it expects the slip.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from station.diagnosis.observations.plate import PlateMotion, Times
from station.diagnosis.observations.tracks import RunTrack
from station.physics.contact import Array

POINTS = 400
GRID_RAD = np.linspace(0.0, 1.4, 281)
LEAST_RATE_RAD_S = 1e-3
STEPS_KNOWN = 3
"""A run with so many steps after the first, which is longer than the others, has a pace of its own."""


@dataclass(frozen=True, eq=False)
class DwellByTilt:
    """Seconds at rest (r, g) when each run's plate has the tilts of GRID_RAD; `typical_rad` is the median onset."""

    seconds: Array
    typical_rad: float

    def at(self, tilt_rad: Array | float) -> Array:
        """Returns seconds (r,) when each run's plate has the tilt `tilt_rad`, (r,) or one for all."""
        position = np.clip(np.asarray(tilt_rad) / GRID_RAD[1], 0.0, len(GRID_RAD) - 1.001)
        below = np.broadcast_to(position.astype(np.int64), len(self.seconds))
        share, run = position - below, np.arange(len(self.seconds))
        return (1.0 - share) * self.seconds[run, below] + share * self.seconds[run, below + 1]

    def typical(self) -> Array:
        """Returns seconds (r,) at the session's typical onset."""
        return self.at(self.typical_rad)

    def of(self, runs: Sequence[int]) -> DwellByTilt:
        """Returns the rows of the chosen runs."""
        return DwellByTilt(self.seconds[list(runs)], self.typical_rad)


def dwell_by_tilt(tracks: Sequence[RunTrack], rest_ns: Times, plate: PlateMotion) -> DwellByTilt:
    """Returns each run's dwell by tilt, from when its block came to rest; a run that slid is extrapolated at its pace.

    `rest_ns` (r,), ns, is when each run's block came to rest.
    """
    slid = [track.slip_ns for track in tracks if track.slip_ns]
    typical = float(np.median(plate.at(np.array(slid)).tilt_rad)) if slid else float(GRID_RAD[-1])
    ramps = [_Ramp(track, plate) for track in tracks]
    paces = [ramp.pace for ramp in ramps if ramp.pace is not None]
    pace = float(np.median(paces)) if paces else None
    rows = [ramp.seconds(int(rest), pace) for ramp, rest in zip(ramps, rest_ns, strict=True)]
    return DwellByTilt(np.array(rows).reshape(len(rows), len(GRID_RAD)), typical)


class _Ramp:
    """One run's tilt until the slip or the end."""

    def __init__(self, track: RunTrack, plate: PlateMotion) -> None:
        until = max(track.slip_ns or track.end_ns, track.tilt_ns + 1)
        self.time_ns = np.linspace(track.tilt_ns, until, POINTS).astype(np.int64)
        self.tilt_rad = np.maximum.accumulate(plate.at(self.time_ns).tilt_rad)
        second = np.maximum(np.diff(self.time_ns) * 1e-9, 1e-9)
        self.fastest = max(float(np.max(np.diff(self.tilt_rad) / second)), LEAST_RATE_RAD_S)
        self.pace = self._pace(plate.steps_between(track.tilt_ns, until), plate)

    def _pace(self, steps_ns: Times, plate: PlateMotion) -> float | None:
        """Returns the run's mean rate over whole steps relative to its fastest; None if it made too few."""
        if len(steps_ns) < STEPS_KNOWN + 1:
            return None
        first, last = plate.at(steps_ns[[1, -1]]).tilt_rad
        return float(last - first) / max(float(steps_ns[-1] - steps_ns[1]) * 1e-9, 1e-3) / self.fastest

    def seconds(self, rest_ns: int, pace: float | None) -> Array:
        """Returns seconds at rest (g,) at the grid's tilts; `pace` is the session's, for a run that has none."""
        seconds = (self.time_ns - rest_ns) * 1e-9
        reached = np.searchsorted(self.tilt_rad, GRID_RAD)
        known = seconds[np.minimum(reached, POINTS - 1)]
        own = self.pace if self.pace is not None else pace
        mean = (self.tilt_rad[-1] - self.tilt_rad[0]) / max(seconds[-1] - seconds[0], 1e-3)
        rate = max(mean if own is None else own * self.fastest, LEAST_RATE_RAD_S)
        return known + np.maximum(GRID_RAD - self.tilt_rad[-1], 0.0) / rate
