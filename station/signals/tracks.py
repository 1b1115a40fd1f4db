"""Time series of one sensor each, as arrays; the first axis is time, in increasing order."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shared.geometry import Array, corners_on_plate, mark_corners
from shared.messages import CameraGeometry

Times = NDArray[np.int64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]
Texts = NDArray[np.object_]
"""Texts of any lengths: numpy's own kind gives every text the room of the longest."""
T = TypeVar("T", bound="Track")


@dataclass(frozen=True, eq=False, kw_only=True)
class Track:
    """A time series: every field is an array of the same length n, `time_ns` (n,) in increasing order."""

    time_ns: Times

    def __len__(self) -> int:
        return len(self.time_ns)

    def select(self: T, chosen: slice | Booleans | Integers) -> T:
        """Returns the chosen moments (n,); a slice gives views, not copies."""
        return type(self)(**{spec.name: getattr(self, spec.name)[chosen] for spec in fields(self)})

    def between(self: T, from_ns: int, to_ns: int) -> T:
        """Returns the moments with from_ns ≤ time < to_ns, as views."""
        first, last = np.searchsorted(self.time_ns, (from_ns, to_ns))
        return self.select(slice(int(first), int(last)))


@dataclass(frozen=True, eq=False, kw_only=True)
class CornerTrack(Track):
    """One marker: `corner_px` (n, 4, 2) in a fixed order by identity, NaN where it was not found.

    `corner_dt_ns` (n, 4) is each corner's own mid-exposure relative to `time_ns`; `sigma_px` (n,) one corner's
    standard deviation in x and in y; `seq` and `boot_id` (n,) number the frames of each life of the agent.
    """

    corner_px: Array
    corner_dt_ns: Integers
    sigma_px: Array
    found: Booleans
    tipped: Booleans
    seq: Integers
    boot_id: Integers

    @property
    def corner_time_ns(self) -> Integers:
        """The moments (n, 4) at which each corner was seen: with a rolling shutter not all at once."""
        return self.time_ns[:, None] + self.corner_dt_ns

    def seen(self) -> CornerTrack:
        """Returns the frames in which the marker was found."""
        return self.select(self.found)

    def on_plate(self, geometry: CameraGeometry) -> Array:
        """Returns the corners (n, 4, 2) in the plate frame, metres, the parallax of the mark's height undone."""
        return corners_on_plate(self.corner_px.reshape(-1, 2), geometry).reshape(-1, 4, 2)

    def pose(self, geometry: CameraGeometry) -> Array:
        """Returns the block's x, y (m) and yaw (rad) in the plate frame (n, 3), by least squares; the yaw is unwrapped.

        The same fit as `shared.geometry.block_pose_of`, for all frames at once.
        """
        seen = self.on_plate(geometry)
        model = mark_corners(side_m=geometry.marker_side_m, aspect=geometry.marker_aspect)
        centre = seen.mean(axis=1)
        offset = seen - centre[:, None, :]
        cosine = np.einsum("ij,nij->n", model, offset)
        sine = np.einsum("i,ni->n", model[:, 0], offset[:, :, 1]) - np.einsum("i,ni->n", model[:, 1], offset[:, :, 0])
        yaw = np.arctan2(sine, cosine)
        valid = np.isfinite(yaw)
        yaw[valid] = np.unwrap(yaw[valid])
        return np.column_stack([centre, yaw])


@dataclass(frozen=True, eq=False, kw_only=True)
class PoseTrack(Track):
    """A block followed by another tracker: `position_m` (n, 3), `quaternion` (n, 4, plate_from_block), NaN if lost."""

    position_m: Array
    quaternion: Array
    sigma_m: Array
    sigma_rad: Array
    found: Booleans


TOGETHER = 0.1
"""Stamps that are nearer than this share of the usual interval do not tell readings apart. Those of receipt that jitter
by 3 of 10 ms made rates of .1 ms of what lies 10 ms apart, and tilts that were off by .5 degrees at rest
(`pytest -s tests/unit/diagnosis/test_plate.py -k together` prints what none, half and twice as much do)."""


@dataclass(frozen=True, eq=False, kw_only=True)
class AttitudeTrack(Track):
    """The plate: `quaternion` (n, 4, world_from_plate), `rate_rad_s` (n, 3, plate frame), `pivot_m` (n, 3)."""

    quaternion: Array
    rate_rad_s: Array
    pivot_m: Array

    def known(self) -> AttitudeTrack:
        """Returns the readings that have an attitude, without those that are not later than the reading before.

        Nor has it those that say again, of a plate that turns, what the reading before said: a driver that publishes
        faster than its arm answers gives an old attitude a new stamp. Of readings whose stamps are TOGETHER it has the
        last.
        """
        rises = np.diff(self.time_ns, prepend=self.time_ns[:1] - 1) > 0
        known = rises & np.isfinite(self.quaternion).all(axis=1) & ~self._repeats()
        return (self if known.all() else self.select(known))._apart()

    def _apart(self) -> AttitudeTrack:
        if len(self) < 2:
            return self
        after_ns = np.diff(self.time_ns)
        apart = np.append(after_ns > TOGETHER * np.median(after_ns), True)
        return self if apart.all() else self.select(apart)

    def _repeats(self) -> Booleans:
        """Returns true (n,) for readings of a turning plate that are equal to the ones before."""
        said = np.hstack([self.quaternion, self.rate_rad_s])
        same = np.zeros(len(self), dtype=np.bool_)
        same[1:] = (said[1:] == said[:-1]).all(axis=1) & self.rate_rad_s[1:].any(axis=1)
        return same

    @property
    def tilt_rad(self) -> Array:
        """Angle between the plate's normal and up (n,); as `shared.geometry.tilt_of`."""
        return _tilt_rad(self.quaternion)

    @property
    def gravity(self) -> Array:
        """The unit vector of gravity in the plate frame (n, 3)."""
        return _gravity(self.quaternion)

    def at(self, time_ns: ArrayLike) -> Array:
        """Returns world_from_plate (m, 4) at other times (m,), normalised linear between neighbours, held beyond ends.

        At 100 Hz and 10 °/s neighbours are 0.1° apart: the error against the great circle is below 1e-10 rad.

        Raises:
            ValueError: without a single attitude.
        """
        if not len(self):
            raise ValueError("expected at least one attitude of the plate to interpolate, got none")
        aligned = _aligned(self.quaternion)
        # Relative to the first moment a float64 holds every nanosecond of a session.
        base, wanted = self.time_ns[0], np.asarray(time_ns, dtype=np.int64)
        known = (self.time_ns - base).astype(float)
        parts = [np.interp((wanted - base).astype(float), known, aligned[:, axis]) for axis in range(4)]
        mixed = np.stack(parts, axis=-1)
        return mixed / np.linalg.norm(mixed, axis=-1, keepdims=True)

    def tilt_at(self, time_ns: ArrayLike) -> Array:
        """Returns the tilt (m,) in radians at other times (m,)."""
        return _tilt_rad(self.at(time_ns))

    def gravity_at(self, time_ns: ArrayLike) -> Array:
        """Returns the unit vector of gravity in the plate frame (m, 3) at other times (m,)."""
        return _gravity(self.at(time_ns))


@dataclass(frozen=True, eq=False, kw_only=True)
class AngleTrack(Track):
    """Another angle sensor: `angle_rad`, `sigma_rad` (n,), and `gravity` (n, 3, plate frame; zeros: unknown)."""

    angle_rad: Array
    gravity: Array
    sigma_rad: Array


@dataclass(frozen=True, eq=False, kw_only=True)
class CommandTrack(Track):
    """The commands to the arm."""

    run: Integers
    direction: Integers
    azimuth_rad: Array
    angle_rad: Array
    step: Integers
    rate_rad_s: Array


@dataclass(frozen=True, eq=False, kw_only=True)
class MotionTrack(Track):
    """The motions as executed: one row for each that ended, `time_ns` being its begin."""

    end_ns: Integers
    run: Integers
    step: Integers
    failed: Booleans


@dataclass(frozen=True, eq=False, kw_only=True)
class EventTrack(Track):
    """The phases of the runs, one of `shared.messages.PHASES` each."""

    run: Integers
    phase: Texts
    step: Integers
    reason: Texts

    def first(self, phase: str, *, run: int) -> int | None:
        """Returns the moment at which a phase of a run first began; None if it never did."""
        found = np.flatnonzero((self.run == run) & (self.phase == phase))
        return int(self.time_ns[found[0]]) if len(found) else None


@dataclass(frozen=True, eq=False, kw_only=True)
class EnvironmentTrack(Track):
    """The air around the rig."""

    temperature_c: Array
    relative_humidity: Array


def _tilt_rad(quaternion: Array) -> Array:
    norm = np.linalg.norm(quaternion, axis=-1)
    return 2.0 * np.arcsin(np.minimum(1.0, np.hypot(quaternion[..., 1], quaternion[..., 2]) / norm))


def _gravity(quaternion: Array) -> Array:
    """Returns the last row of −R, R being world_from_plate: down, as the plate sees it."""
    w, x, y, z = np.moveaxis(quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True), -1, 0)
    return -np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=-1)


def _aligned(quaternion: Array) -> Array:
    """Gives the same rotations with signs chosen so that neighbours are near each other (q and −q are one rotation)."""
    flips = np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0
    signs = np.concatenate([[1.0], np.cumprod(np.where(flips, -1.0, 1.0))])
    return quaternion * signs[:, None]
