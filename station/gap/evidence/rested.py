"""How long the block had lain when the tilt reached the session's typical onset: what the protocol chose."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from station.gap.evidence.plate import PlateMotion, Times
from station.gap.evidence.tracks import RunTrack
from station.physics.contact import Array

POINTS = 400


def rested_s(tracks: Sequence[RunTrack], rest_ns: Times, plate: PlateMotion) -> Array:
    """Seconds (r,) from when the block came to rest until its plate was as steep as half of all onsets are.

    A run that slid before is continued at the mean rate of its own tilt up to there.
    """
    slid = [track for track in tracks if track.slip_ns]
    if not slid:
        return np.array([max(track.end_ns - rest, 0) * 1e-9 for track, rest in zip(tracks, rest_ns, strict=True)])
    typical = float(np.median(plate.at(np.array([track.slip_ns for track in slid])).tilt_rad))
    return np.array([_one(track, int(rest), plate, typical) for track, rest in zip(tracks, rest_ns, strict=True)])


def _one(track: RunTrack, rest_ns: int, plate: PlateMotion, typical_rad: float) -> float:
    until = max(track.slip_ns or track.end_ns, track.tilt_ns + 1)
    times = np.linspace(track.tilt_ns, until, POINTS).astype(np.int64)
    tilt = plate.at(times).tilt_rad
    reached = np.flatnonzero(tilt >= typical_rad)
    if len(reached):
        return (int(times[reached[0]]) - rest_ns) * 1e-9
    passed = (until - track.tilt_ns) * 1e-9
    rate = max(float(tilt[-1] - tilt[0]) / max(passed, 1e-3), 1e-3)
    return (until - rest_ns) * 1e-9 + (typical_rad - float(tilt[-1])) / rate
