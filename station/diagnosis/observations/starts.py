"""The blocks' poses before their runs, and whether the foam held them there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.tracks import RunTrack
from station.physics.contact import Array

FREE_M = 1e-4


def starts(tracks: Sequence[RunTrack]) -> Array:
    """Returns poses (n, 3), x and y (m) and yaw (rad), before the runs, from the samples or else from the tracks."""
    poses = list[tuple[float, float, float]]()
    for track in tracks:
        sample = track.sample
        seen = track.pose[track.frames(track.level_ns, track.slip_ns or track.end_ns)]
        noted = (sample.start_x_m, sample.start_y_m, sample.start_yaw_rad)
        x, y, yaw = np.median(seen, axis=0) if noted == (0.0, 0.0, 0.0) and len(seen) else noted
        poses.append((float(x), float(y), float(yaw)))
    return np.array(poses).reshape(-1, 3)


def leans(track: RunTrack, setting: Setting) -> bool:
    """Returns true if the block lay against the foam, which holds it, and pushes it aside where it slides along."""
    return bool(setting.free_m(starts([track]))[0] <= FREE_M)
