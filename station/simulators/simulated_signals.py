"""The signals of a simulated session: those of the recorded one, with what the simulation changes put in their place.

Changed are the block's mark, the plate's fiducials, the block's pose of another tracker, the other angle sensors and
the samples. Commands, motions, events and the reported attitude are the recording's own: they were the input.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from shared.geometry import corners_on_plate
from shared.messages import Sample
from shared.rig import RigConfig
from station.physics.contact import Array
from station.physics.model import Model
from station.signals.flags import EXACT_RAD, UNRESOLVED
from station.signals.session import Signals
from station.signals.tracks import AngleTrack, CornerTrack, PoseTrack
from station.simulators.observation import Camera, Seen
from station.simulators.recorded_runs import RecordedRun

Integers = NDArray[np.int64]
_LEVEL_RAD = math.radians(1.0)
_BLINK_S = 1e-3


@dataclass(frozen=True, eq=False, kw_only=True)
class Outcome:
    """The findings of a simulator for n repeated runs; times in s from each run's beginning.

    Attributes:
        onset_s: (n,) the first onset as the camera would stamp it; nan if the block never slid.
        onset_rad: (n,) the tilt at which a plate at rest would have let go, by what the arm reports then.
        pose: (q, 3) x, y, yaw at the moments asked for.
        gravity: (q, 3) unit vector of gravity in the plate as it truly stands then.
    """

    onset_s: Array
    onset_rad: Array
    pose: Array
    gravity: Array


Repeat = Callable[[Integers, Array], Outcome]
"""Simulates the runs, and tells of the moments (q,) asked for: the run's index in the list, and the camera's stamp."""


class _Moments:
    """Collects the moments that all tracks ask for, so that the runs are simulated once."""

    def __init__(self, runs: Sequence[RecordedRun]) -> None:
        self._begin = np.array([run.begin_ns for run in runs], dtype=np.int64)
        self._rows: list[Integers] = []
        self._times: list[Array] = []
        self._count = 0

    def run_of(self, time_ns: Integers) -> Integers:
        """Returns the run (n,) that each moment (n,), ns, belongs to; −1 before the first one."""
        return np.searchsorted(self._begin, time_ns, side="right") - 1

    def ask(self, time_ns: Integers, *, later_s: float = 0.0) -> slice:
        """Asks for moments (q,), all of them in a run; returns their slice of the answer."""
        row = self.run_of(time_ns)
        self._rows.append(row)
        self._times.append(np.asarray((time_ns - self._begin[row]) * 1e-9 + later_s, dtype=float))
        self._count += len(row)
        return slice(self._count - len(row), self._count)

    def answer(self, repeat: Repeat) -> Outcome:
        """Runs the simulator once for all moments."""
        return repeat(np.concatenate(self._rows), np.concatenate(self._times))


def simulated_signals(
    recorded: Signals,
    runs: Sequence[RecordedRun],
    model: Model,
    *,
    rig: RigConfig,
    repeat: Repeat,
    rng: np.random.Generator | None = None,
) -> Signals:
    """Returns the session as simulated.

    Args:
        recorded: the session.
        runs: those of its runs that are repeated, in order.
        model: for the effects on the image.
        rig: for the picture's size.
        repeat: the simulator.
        rng: draws the corners' noise, with the recorded standard deviations; None: there is none.
    """
    moments = _Moments(runs)
    moments.ask(np.array([run.begin_ns for run in runs], dtype=np.int64))
    mark = _Mark(recorded, moments, moving=bool(model.acting("seen")))
    block = _Tracked(recorded.block, moments)
    sensors = {source: _Sensor(track, moments) for source, track in recorded.angles.items()}
    outcome = moments.answer(repeat)
    corners, fiducials = recorded.corners, recorded.fiducials
    if recorded.geometry is not None:
        camera = Camera(recorded.geometry, size_px=(rig.camera.width_px, rig.camera.height_px))
        stage = _Stage(recorded, runs, model, camera, moments=moments, onset_rad=outcome.onset_rad)
        corners = stage.noisy(mark.corners(outcome, stage), rng)
        fiducials = {name: stage.noisy(stage.fiducial(track), rng) for name, track in fiducials.items()}
    simulated = replace(
        recorded,
        corners=corners,
        fiducials=fiducials,
        block=block.track(outcome, runs),
        angles={source: sensor.track(outcome) for source, sensor in sensors.items()},
    )
    return replace(simulated, samples=_samples(simulated, recorded, runs, outcome))


class _Stage:
    """The camera at the moments of a session."""

    def __init__(
        self,
        recorded: Signals,
        runs: Sequence[RecordedRun],
        model: Model,
        camera: Camera,
        *,
        moments: _Moments,
        onset_rad: Array,
    ) -> None:
        self.camera, self.model, self._onset_rad = camera, model, onset_rad
        self._attitude, self._moments = recorded.attitude, moments
        self._tilt_ns = np.array([run.tilt_ns for run in runs], dtype=np.int64)
        self._late_ns = round(model.delay_s() * 1e9)

    def seen(self, time_ns: Integers, pose: Array, velocity: Array) -> Seen:
        """Returns the state on which the image depends, at moments (m,) of a mark at poses (m, 3)."""
        gravity = self._attitude.gravity_at(time_ns - self._late_ns)
        row = self._moments.run_of(time_ns)
        since = (time_ns - self._tilt_ns[np.maximum(row, 0)]) * 1e-9
        return Seen(
            pose=pose,
            velocity=velocity,
            tilt_rad=np.arctan2(np.hypot(gravity[:, 0], gravity[:, 1]), -gravity[:, 2]),
            down_rad=np.arctan2(gravity[:, 1], gravity[:, 0]),
            rest_s=np.where(row >= 0, np.maximum(since, 0.0), 0.0),
            limit_rad=np.where(row >= 0, self._onset_rad[np.maximum(row, 0)], np.nan),
        )

    def fiducial(self, track: CornerTrack) -> CornerTrack:
        """Returns a mark on the plate as the model has it: it stands where it was seen on the level plate."""
        found = track.seen()
        if not len(found):
            return track
        level = self._attitude.tilt_at(found.time_ns) < _LEVEL_RAD
        usual = np.median(found.corner_px[level] if level.any() else found.corner_px, axis=0)
        place = corners_on_plate(usual, self.camera.flat)
        none = np.zeros((len(track), 3))
        pixels = self.camera.fiducial_px(place, self.seen(track.time_ns, none, none), self.model)
        return replace(track, corner_px=np.where(track.found[:, None, None], pixels, np.nan))

    @staticmethod
    def noisy(track: CornerTrack, rng: np.random.Generator | None) -> CornerTrack:
        """Returns the corners with the noise that the recording states for each frame."""
        if rng is None:
            return track
        noise = track.sigma_px[:, None, None] * rng.standard_normal(track.corner_px.shape)
        return replace(track, corner_px=track.corner_px + noise)


class _Mark:
    """The block's mark: asks for its poses, each corner at its own time."""

    def __init__(self, recorded: Signals, moments: _Moments, *, moving: bool) -> None:
        self._track = recorded.corners
        self._chosen = np.flatnonzero(moments.run_of(self._track.time_ns) >= 0)
        self._moving = moving
        own = recorded.geometry is not None
        times, delays = self._track.time_ns[self._chosen], self._track.corner_dt_ns[self._chosen]
        count = (4 if delays.any() else 1) if own else 0
        # A corner may be seen before its frame's run begins: the block rests then.
        self._asked = [self._ask(moments, times, delays[:, corner]) for corner in range(count)]

    def _ask(self, moments: _Moments, time_ns: Integers, delay_ns: Integers) -> tuple[Integers, tuple[slice, ...]]:
        stamps = np.maximum(time_ns + delay_ns, time_ns.min(initial=np.iinfo(np.int64).max))
        later = (0.0, -_BLINK_S, _BLINK_S) if self._moving else (0.0,)
        return stamps, tuple(moments.ask(stamps, later_s=shift) for shift in later)

    def corners(self, outcome: Outcome, stage: _Stage) -> CornerTrack:
        """Returns the track: found where the recording found the mark, and it is in the simulated picture, too."""
        pixels = self._track.corner_px.copy()
        found = self._track.found.copy()
        if not len(self._chosen):
            return self._track
        own = np.empty((len(self._chosen), 4, 2))
        for number, (stamps, slices) in enumerate(self._asked):
            pose = outcome.pose[slices[0]]
            velocity = np.zeros_like(pose)
            if self._moving:
                velocity = (outcome.pose[slices[2]] - outcome.pose[slices[1]]) / (2.0 * _BLINK_S)
            whole = stage.camera.block_px(stage.seen(stamps, pose, velocity), stage.model)
            if len(self._asked) == 1:
                own = whole
            else:
                own[:, number] = whole[:, number]
        inside = found[self._chosen] & stage.camera.inside(own)
        pixels[self._chosen] = np.where(inside[:, None, None], own, np.nan)
        found[self._chosen] = inside
        return replace(self._track, corner_px=pixels, found=found)


class _Tracked:
    """The block as another tracker sees it."""

    def __init__(self, track: PoseTrack, moments: _Moments) -> None:
        self._recorded = track
        self._row = moments.run_of(track.time_ns)
        self._chosen = np.flatnonzero(self._row >= 0)
        self._asked = moments.ask(track.time_ns[self._chosen])

    def track(self, outcome: Outcome, runs: Sequence[RecordedRun]) -> PoseTrack:
        """Returns the track: the pose that the block had when its repetition began, moved and turned as simulated."""
        recorded = self._recorded
        position, quaternion = recorded.position_m.copy(), recorded.quaternion.copy()
        pose, row = outcome.pose[self._asked], self._row[self._chosen]
        for number, run in enumerate(runs):
            mine = row == number
            seen = np.flatnonzero(
                recorded.found & (recorded.time_ns >= run.begin_ns) & (recorded.time_ns < run.until_ns)
            )
            if not mine.any() or not len(seen):
                continue
            frames = self._chosen[mine]
            position[frames, :2] = pose[mine, :2]
            position[frames, 2] = recorded.position_m[seen[0], 2]
            quaternion[frames] = _turned(recorded.quaternion[seen[0]], pose[mine, 2] - run.start[2])
        found = recorded.found & np.isfinite(position).all(axis=1)
        position[~found], quaternion[~found] = np.nan, np.nan
        return replace(recorded, position_m=position, quaternion=quaternion, found=found)


def _turned(quaternion: Array, angle_rad: Array) -> Array:
    """Returns a rotation (4,), turned further about the plate's normal by angles (n,): (n, 4)."""
    half = 0.5 * angle_rad[:, None]
    w, x, y, z = quaternion
    return np.cos(half) * quaternion + np.sin(half) * np.array([-z, -y, x, w])


class _Sensor:
    """Another angle sensor, which measures the plate's true attitude."""

    def __init__(self, track: AngleTrack, moments: _Moments) -> None:
        self._recorded = track
        self._chosen = np.flatnonzero(moments.run_of(track.time_ns) >= 0)
        self._asked = moments.ask(track.time_ns[self._chosen])

    def track(self, outcome: Outcome) -> AngleTrack:
        """Returns the track, without noise; a sensor that told no direction of gravity still tells none."""
        angle, gravity = self._recorded.angle_rad.copy(), self._recorded.gravity.copy()
        true = outcome.gravity[self._asked]
        angle[self._chosen] = np.arctan2(np.hypot(true[:, 0], true[:, 1]), -true[:, 2])
        known = np.any(gravity[self._chosen] != 0.0, axis=1, keepdims=True)
        gravity[self._chosen] = np.where(known, true, 0.0)
        return replace(self._recorded, angle_rad=angle, gravity=gravity)


# --- samples --------------------------------------------------------------------------------------------------------


def _samples(
    simulated: Signals, recorded: Signals, runs: Sequence[RecordedRun], outcome: Outcome
) -> tuple[Sample, ...]:  # fmt: skip
    """Returns the recorded samples with the simulated onsets; a run that was not repeated keeps its own."""
    index = {run.run: number for number, run in enumerate(runs)}
    return tuple(
        _sample(sample, simulated, runs[index[sample.run]], index[sample.run], outcome)
        if sample.run in index
        else sample
        for sample in recorded.samples
    )


def _sample(sample: Sample, simulated: Signals, run: RecordedRun, number: int, outcome: Outcome) -> Sample:
    x, y, yaw = (float(value) for value in run.start)
    began = replace(sample, start_x_m=x, start_y_m=y, start_yaw_rad=yaw, **_reference(simulated, run))
    if run.velocity.any():
        return began
    onset_s = float(outcome.onset_s[number])
    if math.isnan(onset_s):
        steepest = float(simulated.attitude.between(run.begin_ns, run.end_ns).tilt_rad.max(initial=0.0))
        return replace(began, censored=True, slip_ns=0, detect_ns=0, onset_angle_rad=steepest, onset_sigma_rad=0.0)
    slip_ns = run.begin_ns + round(onset_s * 1e9)
    low, high = _step(simulated, run.run, slip_ns)
    return replace(
        began,
        censored=False,
        slip_ns=slip_ns,
        detect_ns=_detected_ns(simulated, run, began.reference_corners_px) or slip_ns,
        onset_angle_rad=float(outcome.onset_rad[number]),
        onset_sigma_rad=EXACT_RAD,
        flags=tuple(flag for flag in began.flags if flag != UNRESOLVED),
        step_from_rad=low,
        step_to_rad=high,
    )


def _reference(simulated: Signals, run: RecordedRun) -> dict[str, tuple[float, ...]]:
    """Returns the corners before the tilt and at the end of the run; nothing where no mark was tracked."""
    frames = simulated.corners.between(run.begin_ns, run.until_ns).seen()
    before = frames.between(run.begin_ns, run.tilt_ns + 1)
    if not len(before):
        return {}
    after = frames.between(run.begin_ns, run.end_ns + 1)
    means = before.corner_px.mean(axis=0), after.corner_px[-1]
    reference, post = (tuple(values.ravel().tolist()) for values in means)
    return {"reference_corners_px": reference, "post_corners_px": post}


def _detected_ns(simulated: Signals, run: RecordedRun, reference_px: tuple[float, ...]) -> int:
    """Gives the first frame in which three corners are more than 10 + θ pixels from their reference; 0 without one."""
    frames = simulated.corners.between(run.tilt_ns, run.end_ns + 1).seen()
    if not len(frames) or len(reference_px) != 8:
        return 0
    moved = np.linalg.norm(frames.corner_px - np.reshape(reference_px, (4, 2)), axis=2)
    limit = 10.0 + np.degrees(simulated.attitude.tilt_at(frames.time_ns))
    slipped = np.flatnonzero((moved > limit[:, None]).sum(axis=1) >= 3)
    return int(frames.time_ns[slipped[0]]) if len(slipped) else 0


def _step(signals: Signals, run: int, at_ns: int) -> tuple[float, float]:
    """Returns the tilt step in which a moment fell: where it started and where it was to end."""
    chosen = (signals.motions.run == run) & (signals.motions.step > 0)
    targets = {
        int(step): float(angle)
        for step, angle, of in zip(signals.commands.step, signals.commands.angle_rad, signals.commands.run, strict=True)
        if of == run
    }
    before, target = 0.0, 0.0
    for begin_ns, step in zip(signals.motions.time_ns[chosen], signals.motions.step[chosen], strict=True):
        angle = targets.get(int(step), target)
        if begin_ns > at_ns:
            break
        before, target = (target, angle) if angle != target else (before, target)
    return before, target
