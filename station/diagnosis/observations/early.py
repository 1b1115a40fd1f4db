"""A run's last moments at rest and first millimetres of sliding: the path, and the pull and press meanwhile."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from station.diagnosis.observations.driving import driving
from station.diagnosis.observations.plate import PlateMotion, Times
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.swing import Swing
from station.diagnosis.observations.tracks import RunTrack
from station.physics.contact import Array
from station.signals.flags import EXACT_RAD

FARTHEST_M = 4e-3
BEFORE_S, AFTER_S = 0.3, 0.25
"""The slip is sought within this time before and after the rig's, s."""

LEAD_S = 0.25
"""Rest before that, from which the place at rest is taken, s."""

FREE_M, OUTWARDS_M = 1e-3, 1e-4
"""A slide is used until it is within FREE_M of the foam and nearer to it than at rest by OUTWARDS_M."""

LEAST_FRAMES = 6
GRID_S = 1e-3


@dataclass(frozen=True, eq=False, kw_only=True)
class Early:
    """The first millimetres of one slide; times in s from the slip as the rig read it.

    `time_s` (n,) are the frames, `path_m` (n,) the way that the block had come, and `sigma_m` its noise. On the even
    grid `grid_s` (m,), `pull` and `press` are the moving plate's per mass, m/s²; `tilt_rad` are the tilts at which a
    plate at rest would have the same ratio of pull to press, `plate_rad` the plate's own. `swing` has what another
    pivot would change of them, if that is known.
    """

    time_s: Array
    path_m: Array
    sigma_m: float
    grid_s: Array
    pull: Array
    press: Array
    tilt_rad: Array
    plate_rad: Array
    swing: Swing | None = None

    def turning_about(self, arm_m: Array) -> Early:
        """Returns the same run on a plate whose true pivot has the arm `arm_m` (3,), m in P, to the configured one."""
        if self.swing is None:
            return self
        pull, press = self.swing.loads(arm_m)
        return replace(self, pull=pull, press=press, tilt_rad=self.swing.tilt_rad(self.swing.per_m @ arm_m))

    @cached_property
    def rise(self) -> Array:
        """The relative rise (m,) per second of the friction that the tilt asks for, on the grid, while it grows."""
        risen = np.maximum.accumulate(self.tilt_rad)
        return np.gradient(np.log(np.maximum(np.tan(risen), 1e-3)), self.grid_s)

    def at(self, values: Array, time_s: float) -> float:
        """Returns the interpolated value of grid values (m,) at a time."""
        return float(np.interp(time_s, self.grid_s, values))


def early(track: RunTrack, plate: PlateMotion, setting: Setting) -> Early | None:
    """Returns the first millimetres of a run; None if it did not slide, or not far enough before it came to the foam.

    An onset that is exact needs none, and of one that could not be fitted none is known.
    """
    if not track.slid or not track.sample.onset_sigma_rad > EXACT_RAD:
        return None
    from_ns = max(track.tilt_ns, track.slip_ns - round((BEFORE_S + LEAD_S) * 1e9))
    frames = track.frames(from_ns, track.stop_ns)
    time_ns, place = track.time_ns[frames], track.pose[frames, :2]
    still = time_ns < track.slip_ns
    if still.sum() < LEAST_FRAMES or (~still).sum() < LEAST_FRAMES:
        return None
    offset = place - np.median(place[still], axis=0)
    free = setting.free_m(place)
    at_foam = free < min(FREE_M, float(np.median(free[still])) - OUTWARDS_M)
    far = ~still & ((np.hypot(offset[:, 0], offset[:, 1]) > FARTHEST_M) | at_foam)
    last = int(np.argmax(far)) if far.any() else len(offset) - 1
    length = float(np.hypot(offset[last, 0], offset[last, 1]))
    if length < 0.5 * FARTHEST_M or last - int(still.sum()) < LEAST_FRAMES:
        return None
    way = offset[last] / length
    path = offset[: last + 1] @ way - _sag(track, plate, time_ns[: last + 1], offset[still] @ way, way)
    return _loaded(track, plate, (time_ns[: last + 1], path), way)


def _sag(track: RunTrack, plate: PlateMotion, time_ns: Times, resting_m: Array, way: Array) -> Array:
    """Returns the apparent motion (n,), m, with the tilt (picture or soft sole), from level to now, relative to now."""
    level = track.pose[track.frames(track.level_ns, track.tilt_ns), :2]
    if not len(level):
        return np.zeros(len(time_ns))
    sine = np.sin(plate.at(time_ns).tilt_rad)
    now = float(np.median(sine[: len(resting_m)]))
    here = track.pose[track.frames(int(time_ns[0]), track.slip_ns), :2]
    shift = float((np.median(here, axis=0) - np.median(level, axis=0)) @ way)
    return shift / max(now, 1e-3) * (sine - now)


def _loaded(track: RunTrack, plate: PlateMotion, course: tuple[Times, Array], way: Array) -> Early:
    time_ns, path_m = course
    time_s: Array = np.asarray((time_ns - track.slip_ns) * 1e-9, dtype=np.float64)
    grid_s = np.arange(time_s[0] - GRID_S, time_s[-1] + 2 * GRID_S, GRID_S)
    at = plate.at(track.slip_ns + np.round(grid_s * 1e9).astype(np.int64))
    place = np.median(track.pose[track.frames(int(time_ns[0]), track.slip_ns), :2], axis=0)
    places = np.broadcast_to(place, (len(grid_s), 2))
    resting = driving(at, places, np.zeros_like(places))
    sliding = driving(at, places, _speed(time_s, path_m, grid_s)[:, None] * way)
    swing = Swing.of(at, way, sliding=sliding, resting=resting)
    pull, press = swing.sliding
    return Early(
        time_s=time_s,
        path_m=path_m,
        sigma_m=track.sigma_m,
        grid_s=grid_s,
        pull=pull,
        press=press,
        tilt_rad=swing.tilt_rad(np.zeros((2, 1))),
        plate_rad=at.tilt_rad,
        swing=swing,
    )


def _speed(time_s: Array, path_m: Array, grid_s: Array) -> Array:
    """Returns the block's approximate speed (m,) on the grid, from the slope of a cubic."""
    sliding = time_s >= 0.0
    slope = np.polyder(np.polyfit(time_s[sliding], path_m[sliding], 3))
    return np.where(grid_s > 0.0, np.maximum(np.polyval(slope, grid_s), 0.0), 0.0)
