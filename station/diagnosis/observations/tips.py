"""The runs in which the block toppled instead of sliding, and the steepness of the plate in these and all others.

The picture of a block that topples does not measure its friction, so such frames are in no channel. Whether a run ended
so is an observation of its own: yes or no, at a steepness.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.observations.plate import PlateMotion, Times
from station.diagnosis.observations.tracks import RunTrack
from station.physics.contact import Array, Bools
from station.signals.tracks import CornerTrack

if TYPE_CHECKING:
    from station.diagnosis.observations.build import Recorded

FLAG = "tipped"
"""The flag of a sample whose run was given up because the block toppled."""

LEAST_FRAMES = 5
"""Toppled frames in succession that make a block that topples; single ones are bad pictures."""

FALL_NS = 400_000_000
"""A block that begins to topple is seen to topple within this time."""

LOOKS = 200


@dataclass(frozen=True, eq=False, kw_only=True)
class Tips:
    """Runs (r,) in which the block might have toppled before it slid.

    `run` is the run's index in the evidence; `stood` (r, 4) is the largest steepness tan(tilt) · cos of the descent's
    angle to each edge's normal, at quarter turns from the block's x, at which the block was still seen to stand,
    `fallen` (r, 4) that at which it was seen to topple (nan if it never did); `from_ns` to `to_ns` is when it toppled,
    or the tilt up to its steepest.
    """

    run: Times
    stood: Array
    fallen: Array
    from_ns: Times
    to_ns: Times

    def __len__(self) -> int:
        return len(self.run)

    @property
    def tipped(self) -> Bools:
        """True (r,) for each run that ended so."""
        return np.asarray(np.isfinite(self.fallen).all(axis=1), dtype=np.bool_)


NO_TIPS = Tips(
    run=np.zeros(0, dtype=np.int64),
    stood=np.zeros((0, 4)),
    fallen=np.zeros((0, 4)),
    from_ns=np.zeros(0, dtype=np.int64),
    to_ns=np.zeros(0, dtype=np.int64),
)


def tips_of(recorded: Recorded) -> Tips:
    """Returns the tips of the runs whose plate was tilted and whose block's heading is known."""
    corners = recorded.signals.corners
    rows = [
        row
        for run, track in enumerate(recorded.tracks)
        if (row := _row(run, track, corners, recorded.plate)) is not None
    ]
    return _stacked(rows)


_Row = tuple[int, Array, Array, int, int]


def _stacked(rows: Sequence[_Row]) -> Tips:
    if not rows:
        return NO_TIPS
    run, stood, fallen, from_ns, to_ns = zip(*rows, strict=True)
    return Tips(
        run=np.array(run, dtype=np.int64),
        stood=np.array(stood),
        fallen=np.array(fallen),
        from_ns=np.array(from_ns, dtype=np.int64),
        to_ns=np.array(to_ns, dtype=np.int64),
    )


def _row(run: int, track: RunTrack, corners: CornerTrack, plate: PlateMotion) -> _Row | None:
    yaw = _yaw(track)
    until = track.slip_ns or track.end_ns
    if yaw is None or until <= track.tilt_ns:
        return None
    times = np.linspace(track.tilt_ns, until, LOOKS).astype(np.int64)
    steepness, tilt = _steepness(times, yaw, plate)
    if tilt.max() < thresholds.LEAST_TILT_RAD:
        return None
    fell_ns = _fell_ns(track, corners, int(times[tilt.argmax()]))
    if fell_ns is None:
        stood, steepest = steepness.max(axis=0), steepness.max(axis=1).argmax()
        return run, stood, np.full(4, np.nan), track.tilt_ns, int(times[steepest])
    before = times <= fell_ns - FALL_NS
    stood = steepness[before].max(axis=0, initial=0.0)
    fallen = np.maximum(steepness[times <= fell_ns].max(axis=0, initial=0.0), stood)
    return run, np.minimum(stood, 0.999 * fallen), fallen, fell_ns - FALL_NS, fell_ns


def _yaw(track: RunTrack) -> float | None:
    """Returns the block's yaw before the tilt, rad; None if unknown."""
    seen = track.pose[track.frames(track.level_ns, track.tilt_ns), 2]
    if len(seen):
        return float(np.median(seen))
    return track.sample.start_yaw_rad or None


def _steepness(time_ns: Times, yaw_rad: float, plate: PlateMotion) -> tuple[Array, Array]:
    """Returns the steepness (n, 4) towards each edge (see `Tips`), ≥ 0, and the tilt (n,), rad, at times (n,), ns."""
    at = plate.at(time_ns)
    off = np.asarray(at.down_rad - yaw_rad)[:, None] - np.pi / 2 * np.arange(4.0)
    return np.tan(at.tilt_rad)[:, None] * np.maximum(np.cos(off), 0.0), at.tilt_rad


def _fell_ns(track: RunTrack, corners: CornerTrack, steepest_ns: int) -> int | None:
    """Returns the time at which the block was first seen to topple; None if it was not, or only once it slid.

    If only the sample says that it toppled, the time is that of the steepest plate.
    """
    until = track.slip_ns or track.end_ns
    first, last = np.searchsorted(corners.time_ns, (track.tilt_ns, until))
    seen = corners.found[first:last]
    tipped = (corners.tipped[first:last] & seen)[seen]
    if len(tipped) >= LEAST_FRAMES:
        run = np.convolve(tipped, np.ones(LEAST_FRAMES), mode="valid") >= LEAST_FRAMES
        if run.any():
            return int(corners.time_ns[first:last][seen][int(run.argmax())])
    return steepest_ns if FLAG in track.sample.flags and not track.slip_ns else None
