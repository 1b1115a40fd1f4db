"""Turns a recording into arrays: for each run its start, its slide's frames and the plate's motion."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import savgol_filter

from shared.geometry import Array
from station.recording.arrays import load_signals
from station.recording.reader import open_recording
from station.signals.session import Signals
from station.signals.tracks import AttitudeTrack

GRAVITY = 9.81
TABLE_S = 1e-3
STEP_S = 6e-3
BEFORE_S, AFTER_S = 0.45, 0.15
"""The plate's motion is tabulated this long around the slide, for clocks that are off."""
EARLY_S = 0.03
"""Frames from this long before the first guess of the slip on belong to the path, earlier ones to the start."""
DENSE_S = 0.12
"""Every frame counts up to here after the slip, then every third."""
COLUMNS = 16
"""Gravity's direction (3), the world's x and y in the plate frame (6), rate (2), acceleration (2), pivot's (3)."""


@dataclass(eq=False)
class Session:
    """Arrays over all runs (r); `first` and `row` (r + 1) cut frames (f) and plate rows (p) into runs.

    `fact` (r, 22): 0 slip (s after its table's begin), 1-2 start (m), 3-4 gravity's share there, 5 frames at rest,
    6 yaw, 7 mount, 8 time at rest at the slip (s), 9 run number, 10 censored, 11 sigma (m), 12-14 rest sums zz, gz, gg,
    15-18 the fiducial's n, zz, gz, gg, 19 the longest step of its slide (s),
    20 the width of a cell of its slip (s), 21 the kinetic drop for which that was found.
    Frames are (time, x, y); plate rows as COLUMNS says.
    """

    fact: Array
    frame: Array
    first: Array
    plate: Array
    row: Array


def read(path: Path) -> Session:
    """The session of a recording; its rig file is looked for beside it."""
    return build(load_signals(open_recording(path)), _reach_m(path))


def _reach_m(path: Path) -> float:
    rig = path.with_name("rig.toml")
    if not rig.exists():
        return 0.037
    told = tomllib.loads(rig.read_text())
    return 0.5 * told["plate"]["opening_m"] - 0.65 * told["block"]["size_m"][0] - 1e-3


def build(signals: Signals, reach_m: float) -> Session:
    """The session of signals; a block farther than `reach_m` from the middle may touch the border."""
    geometry = signals.geometry
    assert geometry is not None
    seen = signals.corners.select(signals.corners.found & ~signals.corners.tipped)
    place, yaw = seen.on_plate(geometry).mean(axis=1), seen.pose(geometry)[:, 2]
    sigma_m = np.median(seen.sigma_px) * geometry.mm_per_px * 1e-3 / 2
    motion = _Motion(signals.attitude)
    fiducial = next(iter(signals.fiducials.values()), None)
    facts, frames, plates = [], [], []
    samples = signals.samples
    for number, sample in enumerate(samples):
        ends = samples[number + 1].start_ns if number + 1 < len(samples) else seen.time_ns[-1]
        part = slice(*np.searchsorted(seen.time_ns, (sample.start_ns, ends)))
        t, z = seen.time_ns[part], place[part]
        if len(t) < 30:
            continue
        fact = np.zeros(22)
        if sample.censored or sample.slip_ns == 0:
            top = motion.highest(sample.start_ns, ends)
            slip_ns, end_ns, fact[10] = top, top + 1, 1.0
        else:
            slip_ns, end_ns = sample.slip_ns, _stop_ns(t, z, sample.slip_ns, sigma_m, reach_m)
        base = slip_ns - int(BEFORE_S * 1e9)
        rest = (t < slip_ns - EARLY_S * 1e9) & (t > sample.start_ns)
        if rest.sum() < 10 or end_ns <= slip_ns:
            continue
        g = motion.gravity(t[rest])[:, :2]
        start, lean = z[rest].mean(axis=0), g.mean(axis=0)
        off, tilt = z[rest] - start, g - lean
        fact[:10] = (
            *((slip_ns - base) * 1e-9, *start, *lean, rest.sum(), np.median(yaw[part][rest]), sample.plate_mount_rad),
            *((slip_ns - sample.rest_ns) * 1e-9 if sample.rest_ns else 60.0, sample.run),
        )
        fact[11:15] = sigma_m, (off**2).sum(), (off * tilt).sum(), (tilt**2).sum()
        fact[19] = STEP_S
        if fiducial is not None:
            fact[15:19] = _sums(fiducial.between(sample.start_ns, ends).seen(), geometry, motion)
        path = (t >= slip_ns - EARLY_S * 1e9) & (t <= end_ns)
        path &= (t < slip_ns + DENSE_S * 1e9) | (np.arange(len(t)) % 3 == 0)
        frames.append(np.column_stack([(t[path] - base) * 1e-9, z[path]]) if not fact[10] else np.zeros((0, 3)))
        plates.append(motion.table(base, end_ns + int(AFTER_S * 1e9)))
        facts.append(fact)
    return Session(np.array(facts), np.concatenate(frames), _cuts(frames), np.concatenate(plates), _cuts(plates))


def _cuts(parts: list[Array]) -> Array:
    return np.concatenate([[0], np.cumsum([len(part) for part in parts])]).astype(np.int64)


def _stop_ns(t: Array, z: Array, slip_ns: int, sigma_m: float, reach_m: float) -> int:
    """Some frames after the block has come to rest, or when it comes near the border."""
    near = np.flatnonzero((np.hypot(*z.T) > reach_m) & (t > slip_ns))
    final = np.median(z[-8:], axis=0)
    moving = np.flatnonzero((np.hypot(*(z - final).T) > 5 * sigma_m + 2e-5) & (t > slip_ns) & (t < slip_ns + 1.5e9))
    last = t[min(moving[-1] + 6, len(t) - 1)] if len(moving) else 0
    return int(min(last, t[near[0]] - 1) if len(near) else last)


def _sums(track, geometry, motion: _Motion) -> tuple[float, ...]:
    z, g = track.on_plate(geometry).mean(axis=1), motion.gravity(track.time_ns)[:, :2]
    # A sagging camera shifts the picture: in metres less for a mark that is nearer to it.
    nearer = 1.0 - geometry.mark_height_m / geometry.camera_height_m if geometry.camera_height_m else 1.0
    z, g = z - z.mean(axis=0), (g - g.mean(axis=0)) / nearer
    return len(z), float((z**2).sum()), float((z * g).sum()), float((g**2).sum())


class _Motion:
    """The plate's motion between recorded attitudes: gravity by cubic Hermite, rates linear, accelerations level."""

    def __init__(self, track: AttitudeTrack) -> None:
        self.base = track.time_ns[0]
        self.time = (track.time_ns - self.base) * 1e-9
        w, x, y, z = (track.quaternion / np.linalg.norm(track.quaternion, axis=1, keepdims=True)).T
        down = -np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1)
        world_x = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], axis=1)
        world_y = np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], axis=1)
        self.vectors = np.stack([down, world_x, world_y], axis=1)
        self.rate = track.rate_rad_s
        self.turning = -np.cross(self.rate[:, None, :], self.vectors)
        self.spin_up = np.diff(self.rate, axis=0) / np.diff(self.time)[:, None]
        self.pivot = self._pivot(track.pivot_m)
        self.tilt = track.tilt_rad

    def _pivot(self, pivot_m: Array) -> Array:
        """The pivot's acceleration in the plate frame, smoothed over 7 samples (a cubic)."""
        if np.ptp(pivot_m, axis=0).max() < 1e-7:
            return np.zeros_like(pivot_m)
        step = float(np.median(np.diff(self.time)))
        a = savgol_filter(pivot_m, 7, 3, deriv=2, delta=step, axis=0)
        up = -self.vectors[:, 0]
        rows = np.stack([self.vectors[:, 1], self.vectors[:, 2], up], axis=1)
        return np.einsum("nwp,nw->np", rows, a)

    def _at(self, time_ns: Array) -> tuple[Array, Array, Array]:
        t = (np.asarray(time_ns) - self.base) * 1e-9
        k = np.clip(np.searchsorted(self.time, t) - 1, 0, len(self.time) - 2)
        step = self.time[k + 1] - self.time[k]
        return k, np.clip((t - self.time[k]) / step, 0.0, 1.0), step

    def _hermite(self, k: Array, f: Array, step: Array) -> Array:
        f, step = f[:, None, None], step[:, None, None]
        a, b, da, db = self.vectors[k], self.vectors[k + 1], self.turning[k] * step, self.turning[k + 1] * step
        return (1 + 2 * f) * (1 - f) ** 2 * a + f * (1 - f) ** 2 * da + f * f * (3 - 2 * f) * b + f * f * (f - 1) * db

    def gravity(self, time_ns: Array) -> Array:
        """Gravity's unit vector (n, 3) in the plate frame."""
        return self._hermite(*self._at(time_ns))[:, 0]

    def highest(self, from_ns: int, to_ns: int) -> int:
        """When the tilt was largest."""
        first, last = np.searchsorted(self.time, ((from_ns - self.base) * 1e-9, (to_ns - self.base) * 1e-9))
        return int(self.base + self.time[first + int(np.argmax(self.tilt[first:last]))] * 1e9)

    def table(self, from_ns: int, to_ns: int) -> Array:
        """Rows every TABLE_S (n, COLUMNS)."""
        t = from_ns + np.arange(0, to_ns - from_ns, int(TABLE_S * 1e9))
        k, f, step = self._at(t)
        rate = (1 - f)[:, None] * self.rate[k] + f[:, None] * self.rate[k + 1]
        pivot = (1 - f)[:, None] * self.pivot[k] + f[:, None] * self.pivot[k + 1]
        vectors = self._hermite(k, f, step).reshape(len(t), 9)
        return np.column_stack([vectors, rate[:, :2], self._spin_up(k, f), pivot])

    def _spin_up(self, k: Array, f: Array) -> Array:
        """The acceleration, whose jumps within an interval stand where they give its mean (Harten 1989)."""
        last = len(self.spin_up) - 1
        mean, old, new = (self.spin_up[np.clip(k + i, 0, last)][:, :2] for i in (0, -1, 1))
        jump = new - old
        clear = np.abs(jump) > 1e-6
        share = np.where(clear, (new - mean) / np.where(clear, jump, 1.0), 0.0)
        between = clear & (share > 0.0) & (share < 1.0)
        return np.where(between, np.where(f[:, None] < share, old, new), mean)
