"""When the slides began, read anew from their paths: with a kinetic friction of its own, above or below the static.

The rig's estimate takes a slide for a plain one until that run's data demand otherwise, and then reads the kinetic
friction instead of the static. For one run that is the better choice; over a session it hides more than half of a
kinetic drop of four per cent, and whatever else makes slide and onset differ.

In the first millimetres x(t) = c + ∫∫ (pull − mu press) − k ∫ x from t0 on; all but t0 is linear. Let t_k be when the
pull passes mu: a block that starts at t0 > t_k lacks the speed V = ∫ (pull − mu press) from t_k to t0, to first order
the only trace of t0. V is linear, and as often negative as positive where mu is the static friction as well: its mean
says for a session whether its slides are plain, and so does the mean of k. If they are not, each tilt is read where V
would be reached, on V's side of t_k: cut at zero it would read high.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from station.gap.evidence.plate import PlateMotion, Times
from station.gap.evidence.tracks import RunTrack
from station.physics.contact import GRAVITY_M_S2, Array

FARTHEST_M = 4e-3
BEFORE_S, AFTER_S = 0.3, 0.25
"""Where t0 is looked for around the rig's, s."""

LEAD_S = 0.25
"""Of rest before that, for the place at rest."""

LEAST_FRAMES, LEAST_RUNS = 6, 8
GRID_S = 1e-3
COARSE, FINE = 34, 13
DRAG_PER_S = 3.0
"""Prior standard deviation of k."""

ALIKE = 16.0
"""By how much narrower, squared, the prior is around what a session's slides have in common."""

PLAIN_SIGMAS = 4.0
"""Up to so many standard errors of the means of V and k a session's slides count as plain, and the rig's readings stay.
"""

UNSEEN_S, UNSEEN = 0.012, 0.5
"""The attitude's readings do not show how a motion begins and ends: of what its swing changes by within this time
before or after a slip, this share may act at the slip, or not."""

SPREAD = 0.8
"""Standard deviation of the signed root of a standard Gaussian."""


def refined(tracks: Sequence[RunTrack], plate: PlateMotion) -> tuple[RunTrack, ...]:
    """The runs with their slips read anew, if the session's slides are not plain; else as they were."""
    read = [_slip_of(track, plate, _Slowing()) for track in tracks]
    pulls = np.array([(slip.lacking, slip.slowing) for slip in read if slip is not None]).reshape(-1, 2)
    if len(pulls) < LEAST_RUNS:
        return tuple(tracks)
    pulls = np.clip(pulls, -PLAIN_SIGMAS, PLAIN_SIGMAS)
    lacking, slowing = pulls.mean(axis=0) * np.sqrt(len(pulls)) / np.maximum(pulls.std(axis=0), 1.0)
    if lacking < PLAIN_SIGMAS and abs(slowing) < PLAIN_SIGMAS:
        return tuple(tracks)
    alike = _in_common([slip for slip in read if slip is not None])
    read = [_slip_of(track, plate, alike) for track in tracks]
    return tuple(track if slip is None else _moved(track, slip) for track, slip in zip(tracks, read, strict=True))


def _moved(track: RunTrack, slip: _Slip) -> RunTrack:
    return replace(
        track,
        slip_ns=track.slip_ns + round(slip.time_s * 1e9),
        slip_tilt_rad=slip.tilt_rad,
        surely_ns=track.slip_ns,
        sample=replace(track.sample, onset_sigma_rad=slip.tilt_sigma_rad),
    )


@dataclass(frozen=True, slots=True)
class _Slowing:
    """What k is expected to be, and how surely: its mean, and the precision of its prior, in units of DRAG_PER_S."""

    mean: float = 0.0
    precision: float = 1.0


def _in_common(read: Sequence[_Slip]) -> _Slowing:
    """What all slides of a session tell of k: one alone hardly tells it from mu, and would be read as its prior has it.

    A fit under the prior of mean 0 and precision 1 leaves (1 − v) of k, v being the variance that it leaves.
    """
    left = np.clip(np.array([slip.drag_variance for slip in read]), 1e-6, 1.0 - 1e-6)
    known = np.array([slip.drag for slip in read]) / (1.0 - left)
    return _Slowing(float(np.average(known, weights=(1.0 - left) / left)), ALIKE)


@dataclass(frozen=True, slots=True)
class _Slip:
    """A slip's time from the rig's, the still tilt that pulls as much, its standard error; V and k in theirs.

    `drag` is k in units of DRAG_PER_S, and `drag_variance` its variance.
    """

    time_s: float
    tilt_rad: float
    tilt_sigma_rad: float
    lacking: float
    slowing: float
    drag: float
    drag_variance: float


def _slip_of(track: RunTrack, plate: PlateMotion, slowing: _Slowing) -> _Slip | None:
    if not track.slid or not track.sample.onset_sigma_rad > 0:
        return None
    from_ns = max(track.tilt_ns, track.slip_ns - round((BEFORE_S + LEAD_S) * 1e9))
    frames = track.frames(from_ns, track.stop_ns)
    time_ns, place = track.time_ns[frames], track.pose[frames, :2]
    still = time_ns < track.slip_ns
    if still.sum() < LEAST_FRAMES or (~still).sum() < LEAST_FRAMES:
        return None
    offset = place - np.median(place[still], axis=0)
    far = ~still & (np.hypot(offset[:, 0], offset[:, 1]) > FARTHEST_M)
    last = int(np.argmax(far)) if far.any() else len(offset) - 1
    length = float(np.hypot(offset[last, 0], offset[last, 1]))
    if length < 0.5 * FARTHEST_M or last - int(still.sum()) < LEAST_FRAMES:
        return None
    way = offset[last] / length
    path = offset[: last + 1] @ way - _sag(track, plate, time_ns[: last + 1], offset[still] @ way, way)
    early = _Early(track, plate, (time_ns[: last + 1], path), way, slowing)
    return early.slip()


def _sag(track: RunTrack, plate: PlateMotion, time_ns: Times, resting_m: Array, way: Array) -> Array:
    """How far the picture (or a soft sole) moves with the tilt, as it did from level until now, less that now."""
    level = track.pose[track.frames(track.level_ns, track.tilt_ns), :2]
    if not len(level):
        return np.zeros(len(time_ns))
    sine = np.sin(plate.at(time_ns).tilt_rad)
    now = float(np.median(sine[: len(resting_m)]))
    here = track.pose[track.frames(int(time_ns[0]), track.slip_ns), :2]
    shift = float((np.median(here, axis=0) - np.median(level, axis=0)) @ way)
    return shift / max(now, 1e-3) * (sine - now)


class _Early:
    """The first millimetres: times (n,) from the rig's slip on, s, and places, m; pull and press on a fine grid."""

    def __init__(
        self, track: RunTrack, plate: PlateMotion, course: tuple[Times, Array], way: Array, slowing: _Slowing
    ) -> None:
        (time_ns, path_m), self.slowing = course, slowing
        self.time_s: Array = np.asarray((time_ns - track.slip_ns) * 1e-9, dtype=np.float64)
        self.path_m, self.sigma_m = path_m, track.sigma_m
        self.grid_s = np.arange(self.time_s[0] - GRID_S, self.time_s[-1] + 2 * GRID_S, GRID_S)
        at = plate.at(track.slip_ns + np.round(self.grid_s * 1e9).astype(np.int64))
        still_pull, still_press = GRAVITY_M_S2 * (at.gravity[:, :2] @ way), -GRAVITY_M_S2 * at.gravity[:, 2]
        place = np.append(np.median(track.pose[track.frames(int(time_ns[0]), track.slip_ns), :2], axis=0), 0.0)
        velocity = self._speed()[:, None] * np.append(way, 0.0)
        swing = np.cross(at.rate_rad_s, np.cross(at.rate_rad_s, place)) + np.cross(at.acceleration_rad_s2, place)
        self._plate_rad = at.tilt_rad
        self.tilt_rad = _still_tilt(at.tilt_rad, still_pull - swing[:, :2] @ way, still_press + swing[:, 2], still_pull)
        swing = swing + 2.0 * np.cross(at.rate_rad_s, velocity)
        self.pull, self.press = still_pull - swing[:, :2] @ way, still_press + swing[:, 2]
        self._twice = [self._integrated(values) for values in (self.pull, self.press)]

    def _speed(self) -> Array:
        """About how fast the block is, on the grid: a cubic's slope."""
        sliding = self.time_s >= 0.0
        slope = np.polyder(np.polyfit(self.time_s[sliding], self.path_m[sliding], 3))
        return np.where(self.grid_s > 0.0, np.maximum(np.polyval(slope, self.grid_s), 0.0), 0.0)

    def _integrated(self, values: Array) -> tuple[Array, Array, Array]:
        """∫ and ∫∫ on the grid, and ∫∫ at the frames."""
        once = np.concatenate([[0.0], np.cumsum(0.5 * GRID_S * (values[1:] + values[:-1]))])
        twice = np.concatenate([[0.0], np.cumsum(0.5 * GRID_S * (once[1:] + once[:-1]))])
        return once, twice, np.interp(self.time_s, self.grid_s, twice)

    def slip(self) -> _Slip | None:
        """The likeliest slip; None where nothing fits."""
        near = np.linspace(-BEFORE_S, AFTER_S, COARSE)
        near = near[(near > self.time_s[0]) & (near < self.time_s[-LEAST_FRAMES])]
        first = self._best(near) if len(near) > 2 else None
        if first is None:
            return None
        pitch = near[1] - near[0]
        return self._read(*(self._best(np.linspace(first[0] - pitch, first[0] + pitch, FINE)) or first))

    def _best(self, tried: Array) -> tuple[float, float] | None:
        """Of times (k,) from which the block is pulled forwards the likeliest, with the friction of its slide."""
        best: tuple[float, float, float] | None = None
        for t0 in tried.tolist():
            chi2, solved, _ = self._fit(t0)
            pulled = self._at(self.pull, t0) >= solved[0] * self._at(self.press, t0)
            if pulled and (best is None or chi2 < best[0]):
                best = (chi2, t0, float(solved[0]))
        return None if best is None else best[1:]

    def _fit(self, t0: float, *, late: bool = False) -> tuple[float, Array, Array]:
        """χ² of a slide from t0, its numbers (mu, k, c, with `late` the speed that it lacks) and their covariance."""
        since = np.maximum(self.time_s - t0, 0.0)
        drive, drag = (self._since(part, t0, since) for part in self._twice)
        slowed = np.cumsum(np.where(since > 0, self.path_m, 0.0)) * (self.time_s[-1] - self.time_s[0])
        slowed *= DRAG_PER_S / (len(since) - 1)
        columns = [-drag, -slowed, np.ones_like(since), *([-since] if late else [])]
        table = np.column_stack(columns) / self.sigma_m
        value = (self.path_m - drive) / self.sigma_m
        normal = table.T @ table
        normal[1, 1] += self.slowing.precision
        wanted = table.T @ value
        wanted[1] += self.slowing.precision * self.slowing.mean
        inverse: Array = np.asarray(np.linalg.inv(normal + 1e-12 * np.diag(np.diag(normal))), dtype=np.float64)
        solved = inverse @ wanted
        left = value - table @ solved
        beside = self.slowing.precision * (solved[1] - self.slowing.mean) ** 2
        return float(left @ left + beside), solved, inverse

    def _since(self, part: tuple[Array, Array, Array], t0: float, since: Array) -> Array:
        """∫∫ from t0 to each frame."""
        once, twice, at_frames = part
        return np.where(since > 0, at_frames - self._at(twice, t0) - since * self._at(once, t0), 0.0)

    def _read(self, t0: float, mu: float) -> _Slip:
        """See the module."""
        excess = self.pull - mu * self.press
        before = np.flatnonzero((self.grid_s <= t0) & (excess <= 0))
        start = int(before[-1]) if len(before) else 0
        gained = np.concatenate([[0.0], np.cumsum(np.maximum(excess[start:], 0.0))[:-1]]) * GRID_S
        chi2, solved, inverse = self._fit(t0, late=True)
        sigma = float(np.sqrt(inverse[-1, -1] * max(1.0, chi2 / max(len(self.time_s) - 5, 1))))
        lacking = float(np.interp(t0, self.grid_s[start:], gained) + solved[-1])
        passed = self.grid_s[start:] - self.grid_s[start]

        def passed_at(speed: float) -> float:
            """The time from t_k until the speed is reached."""
            return float(np.interp(speed, gained, passed))

        before_s, after_s = (passed_at(speed) for speed in (max(abs(lacking) - sigma, 0.0), abs(lacking) + sigma))
        spread_s = SPREAD * passed_at(sigma) if abs(lacking) < sigma else 0.5 * (after_s - before_s)
        apart = float(np.copysign(passed_at(abs(lacking)), lacking))
        time_s, tilt_rad, sigma_rad = self._expected(self.grid_s[start] + apart, spread_s)
        # k as its prior shrinks it, over how much that then varies.
        drag, variance = float(solved[1]), float(inverse[1, 1])
        slowing = drag / math.sqrt(max(variance * (1.0 - variance), 1e-9))
        lacks = lacking / max(sigma, 1e-9)
        return _Slip(time_s, tilt_rad, max(sigma_rad, 1e-5), lacks, slowing, drag, variance)

    def _expected(self, time_s: float, sigma_s: float) -> tuple[float, float, float]:
        """The time and the tilt that are expected for a slip read at a time, and the tilt's standard error.

        All tilts are as likely, so slips come the more often the faster the pull grows beyond what it was, and none
        while the plate holds: of readings at the begin of a step most are early. A block on the upper side of a plate
        that stops speeding up is let go at once by a per cent: of those, the reading knows no more than that.
        """
        risen = np.maximum.accumulate(self.tilt_rad)
        weight = np.gradient(risen, self.grid_s) * np.exp(-0.5 * ((self.grid_s - time_s) / max(sigma_s, GRID_S)) ** 2)
        if not weight.sum() > 0:
            fastest = float(np.max(np.abs(np.gradient(self.tilt_rad, self.grid_s))))
            return time_s, self._at(self.tilt_rad, time_s), sigma_s * fastest
        mean, square = (float(np.average(risen**power, weights=weight)) for power in (1, 2))
        near = np.abs(self.grid_s - time_s) < UNSEEN_S
        unseen = UNSEEN * float(np.ptp((self.tilt_rad - self._plate_rad)[near])) if near.any() else 0.0
        spread = math.sqrt(max(square - mean**2, 0.0) + unseen**2)
        return float(np.interp(mean, risen, self.grid_s)), mean, spread

    def _at(self, values: Array, time_s: float) -> float:
        return float(np.interp(time_s, self.grid_s, values))


def _still_tilt(tilt_rad: Array, pull: Array, press: Array, still_pull: Array) -> Array:
    """The tilts (n,) at which a plate at rest pulls as much for what it presses as one that is turned does.

    `pull` and `press` are those of the turning plate on a block at rest, `still_pull` gravity's alone, m/s².
    """
    share = pull / np.where(np.abs(still_pull) > 1e-3, still_pull, 1e-3)
    level = np.maximum(press, 1e-3) / GRAVITY_M_S2
    return np.where(np.abs(still_pull) > 1e-3, np.arctan2(np.sin(tilt_rad) * share, level), tilt_rad)
