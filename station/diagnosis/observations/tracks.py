"""The block's track, cut into runs: poses in the plate frame, the times of slip and stop, and the noise."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter
from scipy.spatial.transform import Rotation

from shared.geometry import Array
from shared.messages import CameraGeometry, Sample
from station.diagnosis.observations.plate import Times
from station.diagnosis.observations.track_noise import corner_sigma_px, track_noise
from station.physics.contact import Bools
from station.signals.flags import NO_TILT
from station.signals.session import Signals
from station.signals.tracks import CornerTrack, PoseTrack

SLOW_M_S, FAST_M_S = 5e-3, 1e-2
NOISE_SPEEDS = 3.0
FLAT_RAD, FLAT_M = 0.05, 3e-3
SETTLED_NS = 60_000_000
"""An impact rings for about 50 ms."""

UNKNOWN_M, UNKNOWN_RAD = 1e-4, 1e-3
"""The noise of another tracker's track that neither reports nor shows it, m and rad."""

_STOP_FRAMES = 4
_TURNED = 0.5
"""The least norm of a valid quaternion: a tracker that lost its target writes zeros."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RunTrack:
    """One run: its sample, frames (n,), poses (n, 3: x, y in m, yaw in rad, in P), and the mark's corners on the plate.

    `corner_m` (n, 4, 2) is None for blocks followed by another tracker. The plate lay level from `level_ns` to
    `tilt_ns`; `slip_ns` is the onset and `stop_ns` the end of the usable slide (0: no slide); `end_ns` is the run's
    end. `slip_tilt_rad` is the tilt at which a plate at rest would have released the block, if it was re-estimated,
    else 0; from `surely_ns` on the block slides whichever estimate of the onset is right. `sigma_m` and `sigma_rad` are
    the standard deviations of place and yaw in one frame, `corner_sigma_m` that of one corner.
    """

    sample: Sample
    time_ns: Times
    pose: Array
    corner_m: Array | None
    level_ns: int
    tilt_ns: int
    slip_ns: int
    stop_ns: int
    end_ns: int
    sigma_m: float
    sigma_rad: float
    corner_sigma_m: float
    slip_tilt_rad: float = 0.0
    surely_ns: int = 0

    @property
    def slid(self) -> bool:
        """True if there is a usable slide."""
        return self.stop_ns > self.slip_ns > 0

    @property
    def held_until_ns(self) -> int:
        """The time at which the block began to move in the tilt, else the run's end; slides that the rig missed count.

        A block that slides a little way to the foam is held there to any tilt. A wrong corner is no motion: places are
        running medians.
        """
        tilting = self.frames(self.tilt_ns, self.end_ns + 1)
        time_ns, place = self.time_ns[tilting], self.pose[tilting, :2]
        if len(time_ns) <= _STOP_FRAMES:
            return self.end_ns
        steady = median_filter(place, size=(2 * _STOP_FRAMES + 1, 1), mode="nearest")
        middle_ns, speed, noise = _speeds(time_ns, steady, self.sigma_m)
        fast = speed > max(FAST_M_S, noise)
        return int(middle_ns[np.argmax(fast)]) if fast.any() else self.end_ns

    def frames(self, from_ns: int, to_ns: int) -> slice:
        """Returns the frames with from_ns ≤ time < to_ns."""
        first, last = np.searchsorted(self.time_ns, (from_ns, to_ns))
        return slice(int(first), int(last))


@dataclass(frozen=True, eq=False)
class _Track:
    time_ns: Times
    pose: Array
    corner_m: Array | None
    sigma_m: Array
    sigma_rad: Array
    corner_sigma_m: Array
    flat: Bools | None = None
    """True (n,) where a block that another tracker follows in space lies flat on the plate."""


def run_tracks(signals: Signals) -> tuple[RunTrack, ...]:
    """Returns the runs that have a sample, in their order; without corners or a calibration their tracks are empty."""
    track = _track_of(signals)
    bounds = _bounds(signals)
    return tuple(_run_track(sample, bounds[sample.run], track) for sample in signals.samples if sample.run in bounds)


def _track_of(signals: Signals) -> _Track:
    if len(signals.block):
        return _other_tracker(signals.block.select(signals.block.found))
    if signals.geometry is None or not len(signals.corners):
        none = np.zeros(0)
        return _Track(np.zeros(0, dtype=np.int64), np.zeros((0, 3)), None, none, none, none)
    return _corners(signals.corners.select(signals.corners.found & ~signals.corners.tipped), signals.geometry)


def _corners(corners: CornerTrack, geometry: CameraGeometry) -> _Track:
    corner_m = corners.on_plate(geometry)
    pose = corners.pose(geometry)
    time_ns = corners.time_ns + np.round(corners.corner_dt_ns.mean(axis=1)).astype(np.int64)
    sigma = corner_sigma_px(corners) * geometry.mm_per_px * 1e-3
    rise = np.diff(np.maximum.accumulate(time_ns), prepend=time_ns[:1] - 1) > 0
    usable = np.isfinite(pose).all(axis=1) & rise
    side = geometry.marker_side_m
    return _Track(
        time_ns[usable],
        pose[usable],
        corner_m[usable],
        sigma[usable] / 2,
        sigma[usable] / (math.sqrt(2) * side),
        sigma[usable],
    )


def _other_tracker(block: PoseTrack) -> _Track:
    usable = np.isfinite(block.quaternion).all(axis=1) & (np.linalg.norm(block.quaternion, axis=1) > _TURNED)
    block = block.select(usable)
    turn = Rotation.from_quat(block.quaternion, scalar_first=True).as_matrix()
    yaw = np.unwrap(_heading(turn))
    height = block.position_m[:, 2]
    upright = np.max(np.abs(turn[:, 2, :]), axis=1) > math.cos(FLAT_RAD)  # on any of its faces
    flat = upright & (np.abs(height - np.median(height)) < FLAT_M)
    place = block.position_m[:, :2]
    along = [track_noise(block.time_ns, values, place, flat) or UNKNOWN_M for values in place.T]
    turning = track_noise(block.time_ns, yaw, place, flat) or UNKNOWN_RAD
    sigma = np.where(block.sigma_m > 0, block.sigma_m, math.hypot(*along) / math.sqrt(2))
    sigma_rad = np.where(block.sigma_rad > 0, block.sigma_rad, turning)
    pose = np.column_stack([place, yaw])
    return _Track(block.time_ns, pose, None, sigma, sigma_rad, sigma, flat)


def _heading(turn: Array) -> Array:
    """Returns the heading (n,) in P, rad, of blocks with orientations (n, 3, 3), on whichever face they lie.

    It is that of the axis after the upright one, x for a block on its own sole: the heading of an axis that stands
    upright itself would be noise.
    """
    upright = np.abs(turn[:, 2, :]).argmax(axis=1)
    flat = np.take_along_axis(turn, ((upright + 1) % 3)[:, None, None], axis=2)[:, :, 0]
    return np.arctan2(flat[:, 1], flat[:, 0])


def _bounds(signals: Signals) -> Mapping[int, tuple[int, int, int, int]]:
    """Returns each run's begin of the level stretch, of the tilt and of the return, and its end, ns."""
    events, bounds = signals.events, dict[int, tuple[int, int, int, int]]()
    for run in signals.runs:
        of_run = events.select(events.run == run)
        first, last = int(of_run.time_ns.min()), int(of_run.time_ns.max())
        moments = dict[str, int]()
        for phase, time_ns in zip(of_run.phase.tolist(), of_run.time_ns.tolist(), strict=True):
            moments.setdefault(phase, time_ns)
        level = moments.get("REFERENCE", moments.get("DWELL", moments.get("LEVEL", first)))
        tilt = moments.get("TILT", moments.get("SLIP", level))
        bounds[run] = (level, tilt, moments.get("RETURN", last), last)
    return bounds


def _run_track(sample: Sample, bounds: tuple[int, int, int, int], track: _Track) -> RunTrack:
    level_ns, tilt_ns, _, end_ns = bounds
    first, last = np.searchsorted(track.time_ns, (min(level_ns, sample.start_ns or level_ns), end_ns + 1))
    chosen = slice(int(first), int(last))
    time_ns, pose = track.time_ns[chosen], track.pose[chosen]
    slip_ns = 0 if sample.censored else sample.slip_ns
    if not slip_ns and (track.flat is not None or NO_TILT in sample.flags):
        flat = np.ones(len(time_ns), dtype=np.bool_) if track.flat is None else track.flat[chosen]
        slip_ns = _landed_ns(time_ns, flat)
    if len(time_ns) == 0:
        sigma = (1e-4, 1e-2, 1e-4)
    else:
        sigma = tuple(
            float(np.median(values[chosen])) for values in (track.sigma_m, track.sigma_rad, track.corner_sigma_m)
        )
    return RunTrack(
        sample=sample,
        time_ns=time_ns,
        pose=pose,
        corner_m=None if track.corner_m is None else track.corner_m[chosen],
        level_ns=level_ns,
        tilt_ns=tilt_ns,
        slip_ns=slip_ns,
        stop_ns=_stop(time_ns, pose, slip_ns, sigma[0]),
        end_ns=end_ns,
        sigma_m=sigma[0],
        sigma_rad=sigma[1],
        corner_sigma_m=sigma[2],
    )


def _landed_ns(time_ns: Times, flat: Bools) -> int:
    """Returns the time, ns, at which a thrown block finally lay flat and the impact was over; 0 if never."""
    if not len(flat) or not flat[-1]:
        return 0
    lifted = np.flatnonzero(~flat)
    first = int(lifted[-1]) + 1 if len(lifted) else 0
    return int(time_ns[first]) + SETTLED_NS if len(flat) - first > 3 * _STOP_FRAMES else 0


def _stop(time_ns: Times, pose: Array, slip_ns: int, sigma_m: float) -> int:
    """Returns the time, ns, at which a block that had moved was slow again, or else the end of the run.

    It is 0 if it never moved.
    """
    if not slip_ns or len(time_ns) < 3 * _STOP_FRAMES:
        return 0
    middle, speed, noise = _speeds(time_ns, pose, sigma_m)
    after = middle > slip_ns
    fast = after & (speed > FAST_M_S)
    if not np.any(fast):
        return 0
    began = int(np.argmax(fast))
    # A noisy track hardly ever stands still, so a slide ends where its speed is within the noise.
    slow = max(SLOW_M_S, noise)
    ended = np.flatnonzero(speed[began:] < slow)
    return int(middle[began + ended[0]]) if len(ended) else int(time_ns[-1])


def _speeds(time_ns: Times, pose: Array, sigma_m: float) -> tuple[Times, Array, float]:
    """Gives times, ns, and speeds (n,), m/s, over _STOP_FRAMES frames each, and the speed that noise alone reaches."""
    step = np.hypot(*(pose[_STOP_FRAMES:, :2] - pose[:-_STOP_FRAMES, :2]).T)
    passed = (time_ns[_STOP_FRAMES:] - time_ns[:-_STOP_FRAMES]) * 1e-9
    middle = (time_ns[_STOP_FRAMES:] + time_ns[:-_STOP_FRAMES]) // 2
    return middle, step / passed, NOISE_SPEEDS * math.sqrt(2) * sigma_m / float(np.median(passed))
