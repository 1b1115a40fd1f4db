"""Frequent messages, collected as plain numbers: a message object takes five times the room of its figures."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shared.geometry import Array
from shared.messages import AngleReading, BlockPose, MarkerCorners, PlatformState
from station.signals.tracks import AngleTrack, AttitudeTrack, CornerTrack, PoseTrack

Integers = NDArray[np.int64]
Row = Callable[[Any], tuple[Sequence[float], Sequence[int]]]
"""The floats and the integers of a message, always as many of each."""


class Columns:
    """Numbers of one topic, row by row. `sorted` gives them in the order of time."""

    def __init__(self, row: Row, *, floats: int, integers: int) -> None:
        self._row = row
        self._widths = (floats, integers)
        self._times = array("q")
        self._floats = array("d")
        self._integers = array("q")

    def add(self, time_ns: int, message: Any) -> None:
        """Takes one message."""
        floats, integers = self._row(message)
        self._times.append(time_ns)
        self._floats.extend(floats)
        self._integers.extend(integers)

    def sorted(self) -> tuple[Integers, Array, Integers]:
        """Times (n,), floats (n, f) and integers (n, i)."""
        times = np.array(self._times, dtype=np.int64)
        floats = np.array(self._floats, dtype=float).reshape(len(times), self._widths[0])
        integers = np.array(self._integers, dtype=np.int64).reshape(len(times), self._widths[1])
        if len(times) > 1 and np.any(np.diff(times) < 0):
            order = np.argsort(times, kind="stable")
            return times[order], floats[order], integers[order]
        return times, floats, integers


_NAN4, _NAN8 = (math.nan,) * 4, (math.nan,) * 8


def _corner_row(message: MarkerCorners) -> tuple[Sequence[float], Sequence[int]]:
    found = message.found and len(message.corners_px) == 8
    pixels = message.corners_px if found else _NAN8
    delays = message.corner_dt_ns if len(message.corner_dt_ns) == 4 else (0, 0, 0, 0)
    return (*pixels, message.sigma_px), (*delays, message.seq, message.boot_id, found, message.tipped)


def corner_columns() -> Columns:
    """For the messages of one marker."""
    return Columns(_corner_row, floats=9, integers=8)


def corner_track(columns: Columns) -> CornerTrack:
    """The marker's track."""
    times, floats, integers = columns.sorted()
    return CornerTrack(
        time_ns=times,
        corner_px=floats[:, :8].reshape(-1, 4, 2),
        sigma_px=floats[:, 8],
        corner_dt_ns=integers[:, :4],
        seq=integers[:, 4],
        boot_id=integers[:, 5],
        found=integers[:, 6].astype(bool),
        tipped=integers[:, 7].astype(bool),
    )


def _pose_row(message: BlockPose) -> tuple[Sequence[float], Sequence[int]]:
    place = (message.x, message.y, message.z) if message.found else _NAN4[:3]
    turn = (message.qw, message.qx, message.qy, message.qz) if message.found else _NAN4
    return (*place, *turn, message.sigma_m, message.sigma_rad), (message.found,)


def pose_columns() -> Columns:
    """For a block followed by another tracker."""
    return Columns(_pose_row, floats=9, integers=1)


def pose_track(columns: Columns) -> PoseTrack:
    """The block's track."""
    times, floats, integers = columns.sorted()
    return PoseTrack(
        time_ns=times,
        position_m=floats[:, :3],
        quaternion=floats[:, 3:7],
        sigma_m=floats[:, 7],
        sigma_rad=floats[:, 8],
        found=integers[:, 0].astype(bool),
    )


def _attitude_row(state: PlatformState) -> tuple[Sequence[float], Sequence[int]]:
    turn = (state.qw, state.qx, state.qy, state.qz)
    return (*turn, state.wx, state.wy, state.wz, state.px, state.py, state.pz), ()


def attitude_columns() -> Columns:
    """For the plate's attitude."""
    return Columns(_attitude_row, floats=10, integers=0)


def attitude_track(columns: Columns) -> AttitudeTrack:
    """The plate's track."""
    times, floats, _ = columns.sorted()
    return AttitudeTrack(time_ns=times, quaternion=floats[:, :4], rate_rad_s=floats[:, 4:7], pivot_m=floats[:, 7:])


def _angle_row(reading: AngleReading) -> tuple[Sequence[float], Sequence[int]]:
    gravity = (reading.gravity_x, reading.gravity_y, reading.gravity_z)
    return (reading.angle_rad, reading.sigma_rad, *gravity), ()


def angle_columns() -> Columns:
    """For one angle sensor."""
    return Columns(_angle_row, floats=5, integers=0)


def angle_track(columns: Columns) -> AngleTrack:
    """The sensor's track."""
    times, floats, _ = columns.sorted()
    return AngleTrack(time_ns=times, angle_rad=floats[:, 0], sigma_rad=floats[:, 1], gravity=floats[:, 2:])
