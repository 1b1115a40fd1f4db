"""The state before a run: tilt and slide of the run before, and the runs since the block was moved by hand."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from station.diagnosis.observations.tracks import RunTrack
from station.physics.contact import Array

MEMORY = ("previous_direction", "turned", "previous_slide", "since_handled")
"""The covariates that a `Contact` does not have."""

HANDLED_M, HANDLED_RAD = 2e-3, 0.1
"""A block that lies farther than this (m, rad) from where the run before left it was moved by hand."""

LAST_FRAMES = 10


def memory_of(runs: Sequence[int], down_rad: Array, tracks: Sequence[RunTrack]) -> dict[str, Array]:
    """Returns the covariates (n,) of `runs`, by their index among the tracks, tilted towards `down_rad` (n,).

    They are nan where unknown.

    They are the direction of the tilt before, the angle from it to this one, the length of the slide before (m), and
    the runs since the block was last moved by hand (nan if it never was: it would be the run's number).
    """
    known = dict(zip(runs, down_rad.tolist(), strict=True))
    direction = np.array([known.get(run - 1, math.nan) for run in runs])
    slid = np.array([_length(tracks[run - 1]) if run > 0 else math.nan for run in runs])
    since = _since_handled(tracks)[list(runs)]
    handled = bool(np.any(np.diff(since) <= 0))
    return {
        "previous_direction": direction,
        "turned": down_rad - direction,
        "previous_slide": slid,
        "since_handled": since if handled else np.full(len(runs), math.nan),
    }


def _length(track: RunTrack) -> float:
    """Returns the block's displacement in a run, m; nan without a track."""
    if not len(track.pose):
        return math.nan
    return float(np.hypot(*(_end(track) - _start(track))[:2]))


def _since_handled(tracks: Sequence[RunTrack]) -> Array:
    count, found = 0, list[int]()
    for before, track in zip([None, *tracks], tracks, strict=False):
        count = 0 if before is None or _handled(before, track) else count + 1
        found.append(count)
    return np.array(found, dtype=np.float64)


def _handled(before: RunTrack, track: RunTrack) -> bool:
    if not len(before.pose) or not len(track.pose):
        return False
    moved = _start(track) - _end(before)
    turned = math.remainder(float(moved[2]), 2 * math.pi)
    return math.hypot(float(moved[0]), float(moved[1])) > HANDLED_M or abs(turned) > HANDLED_RAD


def _start(track: RunTrack) -> Array:
    resting = track.pose[track.frames(track.level_ns, track.tilt_ns)]
    return np.median(resting if len(resting) else track.pose[:LAST_FRAMES], axis=0)


def _end(track: RunTrack) -> Array:
    return np.median(track.pose[-LAST_FRAMES:], axis=0)
