"""The slides frame by frame, from their first window to their last one's end, for comparison with a simulator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.observations.plate import Times
from station.diagnosis.observations.tracks import RunTrack
from station.diagnosis.observations.views import block_view
from station.diagnosis.observations.windows import FRAMES
from station.physics.contact import Array, Bools, View

if TYPE_CHECKING:
    from station.diagnosis.observations.build import Recorded


@dataclass(frozen=True, eq=False, kw_only=True)
class SlideTrack:
    """One slide: the run's index in the evidence, its frames (k,), poses (k, 3) as seen, and the camera's view of them.

    The first FRAMES frames are the first window, from which a simulation takes its start; there are more than these.
    `rest_s` is the block's dwell before it; it began at `slip_ns`.
    """

    run: int
    time_ns: Times
    pose: Array
    view: View
    rest_s: float
    slip_ns: int


@dataclass(frozen=True, eq=False, kw_only=True)
class SlideTracks:
    """All slides; `gravity_at` gives gravity's direction (n, 3) in P at times (n,), ns, as the arm reports it.

    `turns_at` gives the tilt's sign of change (n,) at such times, the tilt (n,), rad, at which that changed, and the
    swings before (n, 3), rad.
    """

    tracks: tuple[SlideTrack, ...]
    gravity_at: Callable[[Times], Array]
    turns_at: Callable[[Times], tuple[Array, Array, Array]]
    opening_radius_m: float

    def of_runs(self, runs: Bools) -> tuple[SlideTrack, ...]:
        """Returns the slides of the masked runs (r,)."""
        return tuple(track for track in self.tracks if runs[track.run])


def slide_tracks(recorded: Recorded) -> SlideTracks:
    """Gives the slides that have windows, each from its first one's beginning to its last one's end, or to the foam."""
    windows = recorded.free_windows
    runs, first = np.unique(windows["run"], return_index=True)
    last = np.append(first[1:], len(windows)) - 1
    ends = zip(runs.tolist(), windows["from_ns"][first].tolist(), windows["to_ns"][last].tolist(), strict=True)
    found = (_slide_track(recorded, *one) for one in ends)
    return SlideTracks(
        tracks=tuple(slide_track for slide_track in found if slide_track is not None),
        gravity_at=recorded.plate.gravity_at,
        turns_at=recorded.plate.turns_at,
        opening_radius_m=recorded.setting.opening_radius_m,
    )


def _slide_track(recorded: Recorded, run: int, from_ns: int, to_ns: int) -> SlideTrack | None:
    track = recorded.tracks[run]
    part = track.frames(from_ns, to_ns + 1)
    touching = np.flatnonzero(recorded.setting.free_m(track.pose[part]) < thresholds.FREE_M)
    part = slice(part.start, part.start + int(touching[0])) if len(touching) else part
    if part.stop - part.start <= FRAMES:
        return None
    time_ns, pose = track.time_ns[part].copy(), track.pose[part].copy()  # the rest of the session may go
    return SlideTrack(
        run=run,
        time_ns=time_ns,
        pose=pose,
        view=_view(recorded, track, time_ns, pose),
        rest_s=float(recorded.dwell_by_tilt.typical()[run]),
        slip_ns=track.slip_ns,
    )


def _view(recorded: Recorded, track: RunTrack, time_ns: Times, pose: Array) -> View:
    plate, seconds = recorded.plate.at(time_ns), (time_ns - track.slip_ns) * 1e-9
    velocity = np.gradient(pose, seconds, axis=0)
    return block_view(
        recorded,
        pose,
        velocity_m_s=velocity[:, :2],
        yaw_rate_rad_s=velocity[:, 2],
        tilt_rad=plate.tilt_rad,
        down_rad=plate.down_rad,
        rest_s=np.asarray(seconds, dtype=np.float64),
    )
