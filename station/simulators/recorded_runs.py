"""The runs of a recorded session, as a simulator has to repeat them: when, and from which pose.

A run on a tilting plate is repeated from its reference on, with the block at rest where the recording saw it. A run
without a tilt, such as a toss onto a level board, is repeated from the moment at which the block lies flat, with the
velocity that it then has; what it did before that is no matter of friction.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shared.errors import UserError
from shared.likely import PLATE_M
from shared.messages import Sample
from station.physics.contact import Array
from station.signals.session import Signals
from station.signals.tracks import Booleans, PoseTrack, Times

_FLAT_RAD, _FLAT_M = math.radians(3.0), 3e-3
_SLIDING_M_S = 0.02
_FITTED = 8
"""The number of frames from which the velocity of a block that comes sliding is taken."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RecordedRun:
    """One run to repeat.

    Attributes:
        run: its number in the recording.
        begin_ns, end_ns: what is repeated of it.
        until_ns: the frames up to here, where the next run begins, show how the block was left.
        start, velocity: (3,) x, y, yaw and their changes at `begin_ns`; m and rad.
        rest_s: how long the block had lain there.
        tilt_ns: when its tilt began; `begin_ns` without one.
        sample: what the recording says of it, if it does.
    """

    run: int
    begin_ns: int
    end_ns: int
    until_ns: int
    start: Array
    velocity: Array
    rest_s: float
    tilt_ns: int
    sample: Sample | None

    @property
    def lies_on_a_plate(self) -> bool:
        """False if the block is farther from the plate's centre than the largest plate is long as the run begins."""
        return bool(np.hypot(*self.start[:2]) <= PLATE_M[1])


@dataclass(frozen=True, eq=False)
class Poses:
    """The block's recorded poses: `time_ns` (n,), `pose` (n, 3) x, y, yaw, and `flat` (n,) where it lay flat."""

    time_ns: Times
    pose: Array
    flat: Booleans

    def between(self, from_ns: int, to_ns: int) -> Poses:
        """Returns the poses with from_ns ≤ time ≤ to_ns."""
        chosen = (self.time_ns >= from_ns) & (self.time_ns <= to_ns)
        return Poses(self.time_ns[chosen], self.pose[chosen], self.flat[chosen])


def recorded_runs(signals: Signals) -> tuple[RecordedRun, ...]:
    """Returns every run that has a start pose, in order.

    Raises:
        UserError: without the plate's attitude, the block's track, or a single run.
    """
    if not len(signals.attitude):
        raise UserError("Expected the plate's attitude in the recording (arm/platform), found none: nothing to repeat")
    poses = poses_of(signals)
    if not len(poses.time_ns):
        raise UserError(
            "Expected the block's track in the recording (camera/corners with a calibration, or block/pose), found none"
        )
    found = [_repeated(signals, poses, run) for run in signals.runs]
    runs = sorted((run for run in found if run is not None), key=lambda run: run.begin_ns)
    _refuse_none(runs)
    ends = [*(run.begin_ns for run in runs[1:]), np.iinfo(np.int64).max]
    return tuple(_until(run, end) for run, end in zip(runs, ends, strict=True))


def runs_on_a_plate(signals: Signals) -> tuple[RecordedRun, ...]:
    """Returns the recorded runs whose blocks a simulator can follow.

    Raises:
        UserError: as `recorded_runs`, and if no block lies on any plate.
    """
    runs = tuple(run for run in recorded_runs(signals) if run.lies_on_a_plate)
    _refuse_none(runs)
    return runs


def _refuse_none(runs: Sequence[RecordedRun]) -> None:
    if not runs:
        raise UserError("Expected at least one run with a block that lies on the plate in the recording, found none")


def poses_of(signals: Signals) -> Poses:
    """Returns the block's poses, from its mark or from another tracker."""
    if len(signals.corners) and signals.geometry is not None:
        seen = signals.corners.seen()
        pose = seen.pose(signals.geometry)
        known = np.isfinite(pose).all(axis=1)
        return Poses(seen.time_ns[known], pose[known], ~seen.tipped[known])
    return _tracked(signals.block)


def _tracked(track: PoseTrack) -> Poses:
    chosen = track.select(track.found)
    if not len(chosen):
        return Poses(np.empty(0, np.int64), np.empty((0, 3)), np.empty(0, bool))
    w, x, y, z = chosen.quaternion.T
    upward = np.column_stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
    height = chosen.position_m[:, 2]
    # Whichever face is up: a block on another face lies flat as well.
    flat = np.abs(upward).max(axis=1) > math.cos(_FLAT_RAD)
    flat &= np.abs(height - np.median(height[flat])) < _FLAT_M if flat.any() else False
    along_x = np.arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))
    along_y = np.arctan2(1 - 2 * (x * x + z * z), 2 * (x * y - w * z)) - np.pi / 2
    # The heading of the block's x axis, or of its y axis where that one stands upright.
    yaw = np.unwrap(np.where(np.abs(upward[:, 0]) < math.sqrt(0.5), along_x, along_y))
    return Poses(chosen.time_ns, np.column_stack([chosen.position_m[:, :2], yaw]), flat)


def _until(run: RecordedRun, next_ns: int) -> RecordedRun:
    return replace(run, end_ns=min(run.end_ns, next_ns), until_ns=next_ns)


def _repeated(signals: Signals, poses: Poses, run: int) -> RecordedRun | None:
    first_ns, end_ns = signals.span_ns(run)
    tilt_ns = signals.events.first("TILT", run=run)
    sample = next((sample for sample in signals.samples if sample.run == run), None)
    if tilt_ns is None:
        if signals.events.first("LEVEL", run=run) is None:
            return None
        return _sliding(poses.between(first_ns, end_ns), run=run, end_ns=end_ns, sample=sample)
    begin_ns = signals.events.first("REFERENCE", run=run) or tilt_ns
    start = _start(poses.between(begin_ns, tilt_ns), sample)
    if start is None or end_ns <= begin_ns:
        return None
    return RecordedRun(
        run=run,
        begin_ns=begin_ns,
        end_ns=end_ns,
        until_ns=end_ns,
        start=start,
        velocity=np.zeros(3),
        rest_s=_rest_s(signals, run, sample, begin_ns),
        tilt_ns=tilt_ns,
        sample=sample,
    )


def _start(seen: Poses, sample: Sample | None) -> Array | None:
    """Returns the mean pose before the tilt, else what the sample says; None without either."""
    if len(seen.time_ns):
        return seen.pose.mean(axis=0)
    if sample is None or not any((sample.start_x_m, sample.start_y_m, sample.start_yaw_rad)):
        return None
    return np.array([sample.start_x_m, sample.start_y_m, sample.start_yaw_rad])


def _rest_s(signals: Signals, run: int, sample: Sample | None, begin_ns: int) -> float:
    since_ns = sample.rest_ns if sample is not None and sample.rest_ns > 0 else signals.events.first("DWELL", run=run)
    return max((begin_ns - since_ns) * 1e-9, 0.0) if since_ns is not None else 0.0


def _sliding(seen: Poses, *, run: int, end_ns: int, sample: Sample | None) -> RecordedRun | None:
    """Returns the stretch from the first frame after which the block lies flat for good.

    It is None if it does not slide then.
    """
    lifted = np.flatnonzero(~seen.flat)
    first = int(lifted[-1]) + 1 if len(lifted) else 0
    lying = Poses(seen.time_ns[first:], seen.pose[first:], seen.flat[first:])
    if len(lying.time_ns) < _FITTED:
        return None
    begin_ns = int(lying.time_ns[0])
    elapsed = (lying.time_ns[:_FITTED] - begin_ns) * 1e-9
    fit = np.polynomial.polynomial.polyfit(elapsed, lying.pose[:_FITTED], 2)
    if math.hypot(fit[1, 0], fit[1, 1]) < _SLIDING_M_S:
        return None
    return RecordedRun(
        run=run,
        begin_ns=begin_ns,
        end_ns=end_ns,
        until_ns=end_ns,
        start=fit[0],
        velocity=fit[1],
        rest_s=0.0,
        tilt_ns=begin_ns,
        sample=sample,
    )


def numbers(runs: Iterable[RecordedRun]) -> Array:
    """Returns the runs' numbers (n,), counted from 0 with the recording's gaps."""
    found = np.array([run.run for run in runs], dtype=float)
    return found - found.min(initial=np.inf)
