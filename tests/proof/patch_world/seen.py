"""A run from outside: its path as the camera has it, its tilt as the arm has it, and its onset."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.proof.patch_world import places as at
from tests.proof.patch_world.camera import HEIGHT_M, PX_PER_M, View
from tests.proof.patch_world.rig import mark_side_m
from tests.proof.patch_world.sensors import gravity_in_plate
from tests.proof.patch_world.world import World

Array = NDArray[np.float64]
_SLIDES_M_S = 4e-3
"""The block slides from this speed on; elastic give and shaking stay below it."""
_RESTS_M_S = 3e-4
"""A block that is slower gives way or creeps: until it is faster than that it moves by some micrometres."""


@dataclass(frozen=True, kw_only=True)
class Seen:
    """One run without noise, at n frames. Lengths in mm, angles in degrees, times in s.

    `path_mm` (n, 2) and `yaw_deg` (n) are the block's as the camera shows it, `sides_px` (n, 4) the lengths of its
    mark's sides, `mark_mm` (n, 2) the fiducial's place,
    `tilt_deg` (n) is what the arm reports at that time and `true_deg` (n) what it is. `level_deg` (n, 2) is what an
    inclinometer on the plate has beside that report, in the plate's axes. `onset_s` and `onset_deg` are
    nan where the block did not slide, and so is `rests_until_s`, the last time before the onset at which it did not yet
    slide away, however slowly.
    """

    time_s: Array
    path_mm: Array
    yaw_deg: Array
    mark_mm: Array
    sides_px: Array
    tilt_deg: Array
    true_deg: Array
    level_deg: Array
    rests_until_s: float
    onset_s: float
    onset_deg: float

    def slide_mm(self, since_s: Array) -> Array:
        """The distance from the place at the onset at times after it (s), (m); nan beyond the last frame."""
        if math.isnan(self.onset_s):
            return np.full(len(since_s), np.nan)
        times = self.onset_s + since_s
        start = [np.interp(self.onset_s, self.time_s, self.path_mm[:, k]) for k in (0, 1)]
        along = [np.interp(times, self.time_s, self.path_mm[:, k]) - start[k] for k in (0, 1)]
        return np.where(times <= self.time_s[-1], np.hypot(*along), np.nan)


def look(world: World, states: Sequence[Array], *, azimuth: float, run: int) -> Seen:
    """The run of a world with these states (n, integrator.SIZE) at its frames."""
    contact, sensing = world.contact, world.sensing
    view = View(world.camera, mark_side_m(contact), contact.height)
    table = np.array(states)
    corners = np.array([view.block(s, azimuth=azimuth, run=run) for s in states]).reshape(-1, 4, 2)
    marks = np.array([view.fiducial(s, azimuth=azimuth, run=run)[:2] for s in states])
    mm = 1e3 / PX_PER_M
    edge = corners[:, 1] - corners[:, 0]
    time_s, speed = table[:, at.T], np.hypot(table[:, at.VX], table[:, at.VY])
    tilt = np.degrees(sensing.gain * table[:, at.MEASURED] + sensing.offset_rad)
    tilt = np.interp(time_s + sensing.stamp_s, time_s, tilt) if sensing.stamp_s else tilt
    onset_s = _onset_s(time_s, speed)
    return Seen(
        time_s=time_s,
        path_mm=corners.mean(axis=1) * mm * (1 - contact.height / HEIGHT_M) * (1, -1),
        yaw_deg=np.degrees(np.arctan2(-edge[:, 1], edge[:, 0])),
        mark_mm=marks * mm * (1, -1),
        sides_px=np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2),
        tilt_deg=tilt,
        true_deg=np.degrees(table[:, at.ANGLE]),
        level_deg=_level_deg(world, table[:, at.ANGLE], np.radians(tilt), azimuth=azimuth),
        rests_until_s=_rests_until_s(time_s, speed, onset_s),
        onset_s=onset_s,
        onset_deg=math.nan if math.isnan(onset_s) else float(np.interp(onset_s, time_s, tilt)),
    )


def _level_deg(world: World, true_rad: Array, told_rad: Array, *, azimuth: float) -> Array:
    gravity = np.array([gravity_in_plate(world.contact, azimuth=azimuth, angle=float(angle)) for angle in true_rad])
    return np.degrees(gravity - np.sin(told_rad)[:, None] * (math.sin(azimuth), -math.cos(azimuth)))


def _onset_s(time_s: Array, speed: Array) -> float:
    """Returns the time of the onset: the first from which the block is faster than the threshold for two frames."""
    fast = (speed[:-1] > _SLIDES_M_S) & (speed[1:] > _SLIDES_M_S)
    if not fast.any():
        return math.nan
    k = int(np.argmax(fast))
    if k == 0:
        return float(time_s[0])
    share = (_SLIDES_M_S - speed[k - 1]) / max(speed[k] - speed[k - 1], 1e-12)
    return float(time_s[k - 1] + share * (time_s[k] - time_s[k - 1]))


def _rests_until_s(time_s: Array, speed: Array, onset_s: float) -> float:
    """The last time before the onset at which the block was slower than `_RESTS_M_S`.

    A block whose pull exceeds its friction by a little slides for tenths of a millimetre before it counts as sliding.
    """
    resting = time_s[(time_s <= onset_s) & (speed < _RESTS_M_S)]
    return float(resting[-1]) if resting.size else onset_s
