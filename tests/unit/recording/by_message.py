"""A recording's signals read message by message: slow, plain, and what `load_signals` has to agree with to the bit."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from typing import Any

import numpy as np

from shared.messages import BlockPose, CameraGeometry, MarkerCorners, Sample
from shared.topics import ANGLE_PREFIX
from station.recording.columns import LETTERS
from station.recording.reader import RecordingReader
from station.signals.session import Signals
from station.signals.tracks import (
    AngleTrack,
    AttitudeTrack,
    CommandTrack,
    CornerTrack,
    EnvironmentTrack,
    EventTrack,
    MotionTrack,
    PoseTrack,
)

TOPICS = (
    *("camera/corners", "camera/plate", "camera/geometry", "block/pose", "arm/platform", "arm/command", "arm/motion"),
    *("session/event", "session/sample", "environment"),
)
Rows = list[tuple[int, Any]]


def signals_by_message(reader: RecordingReader) -> Signals:
    """All signals of a recording."""
    rows: defaultdict[str, Rows] = defaultdict(list)
    topics = [*TOPICS, *(name for name in reader.topics if name.startswith(ANGLE_PREFIX))]
    for item in reader.messages(topics):
        rows[item.topic].append((item.publish_ns, item.message))
    whole = [message for _, message in rows["camera/geometry"] if isinstance(message, CameraGeometry)]
    geometry = [message for message in whole if message.plate_from_pixel]
    for each in rows.values():
        each.sort(key=lambda row: row[0])
    plate = rows["camera/plate"]
    angles = sorted(name for name in rows if name.startswith(ANGLE_PREFIX))
    return Signals(
        corners=_corners(rows["camera/corners"]),
        fiducials={
            number: _corners([row for row in plate if row[1].marker_id == number])
            for number in sorted({message.marker_id for _, message in plate})
        },
        block=_poses(rows["block/pose"]),
        attitude=AttitudeTrack(
            time_ns=_times(rows["arm/platform"]),
            quaternion=_table(rows["arm/platform"], "qw qx qy qz"),
            rate_rad_s=_table(rows["arm/platform"], "wx wy wz"),
            pivot_m=_table(rows["arm/platform"], "px py pz"),
        ),
        commands=CommandTrack(
            time_ns=_times(rows["arm/command"]),
            run=_column(rows["arm/command"], "run", np.int64),
            direction=_column(rows["arm/command"], "direction", np.int64),
            azimuth_rad=_column(rows["arm/command"], "azimuth_rad", float),
            angle_rad=_column(rows["arm/command"], "angle_rad", float),
            step=_column(rows["arm/command"], "step", np.int64),
            rate_rad_s=_column(rows["arm/command"], "rate_rad_s", float),
        ),
        motions=_motions(rows["arm/motion"]),
        events=EventTrack(
            time_ns=_times(rows["session/event"]),
            run=_column(rows["session/event"], "run", np.int64),
            phase=_texts(rows["session/event"], "phase"),
            step=_column(rows["session/event"], "step", np.int64),
            reason=_texts(rows["session/event"], "reason"),
        ),
        environment=EnvironmentTrack(
            time_ns=_times(rows["environment"]),
            temperature_c=_column(rows["environment"], "temperature_c", float),
            relative_humidity=_column(rows["environment"], "relative_humidity", float),
        ),
        angles={
            name.removeprefix(ANGLE_PREFIX): AngleTrack(
                time_ns=_times(rows[name]),
                angle_rad=_column(rows[name], "angle_rad", float),
                sigma_rad=_column(rows[name], "sigma_rad", float),
                gravity=_table(rows[name], "gravity_x gravity_y gravity_z"),
            )
            for name in angles
        },
        geometry=geometry[-1] if geometry else None,
        samples=tuple(message for _, message in rows["session/sample"] if isinstance(message, Sample)),
    )


def _times(rows: Rows) -> Any:
    return np.array([time_ns for time_ns, _ in rows], dtype=np.int64)


def _column(rows: Rows, name: str, dtype: Any) -> Any:
    return np.array([getattr(message, name) for _, message in rows], dtype=dtype)


def _texts(rows: Rows, name: str) -> Any:
    return np.array([getattr(message, name)[:LETTERS] for _, message in rows], dtype=object)


def _table(rows: Rows, names: str) -> Any:
    wanted = names.split()
    return np.array([[getattr(message, name) for name in wanted] for _, message in rows], float).reshape(
        -1, len(wanted)
    )


def _corners(rows: Rows) -> CornerTrack:
    def pixels(message: MarkerCorners) -> Sequence[float]:
        return message.corners_px if message.found and len(message.corners_px) == 8 else (math.nan,) * 8

    def delays(message: MarkerCorners) -> Sequence[int]:
        return message.corner_dt_ns if len(message.corner_dt_ns) == 4 else (0,) * 4

    return CornerTrack(
        time_ns=_times(rows),
        corner_px=np.array([pixels(message) for _, message in rows], float).reshape(-1, 4, 2),
        sigma_px=_column(rows, "sigma_px", float),
        corner_dt_ns=np.array([delays(message) for _, message in rows], np.int64).reshape(-1, 4),
        seq=_column(rows, "seq", np.int64),
        boot_id=_column(rows, "boot_id", np.int64),
        found=_column(rows, "found", bool),
        tipped=_column(rows, "tipped", bool),
    )


def _poses(rows: Rows) -> PoseTrack:
    nowhere = BlockPose(x=math.nan, y=math.nan, z=math.nan, qw=math.nan, qx=math.nan, qy=math.nan, qz=math.nan)
    lost = [(time_ns, message if message.found else nowhere) for time_ns, message in rows]
    return PoseTrack(
        time_ns=_times(rows),
        position_m=_table(lost, "x y z"),
        quaternion=_table(lost, "qw qx qy qz"),
        sigma_m=_column(rows, "sigma_m", float),
        sigma_rad=_column(rows, "sigma_rad", float),
        found=_column(rows, "found", bool),
    )


def _motions(rows: Rows) -> MotionTrack:
    ended = [(publish - one.stamp_ns, one) for publish, one in rows if one.end_ns]
    ended.sort(key=lambda row: row[1].begin_ns + row[0])
    return MotionTrack(
        time_ns=np.array([one.begin_ns + offset for offset, one in ended], dtype=np.int64),
        end_ns=np.array([one.end_ns + offset for offset, one in ended], dtype=np.int64),
        run=_column(ended, "run", np.int64),
        step=_column(ended, "step", np.int64),
        failed=np.array([bool(one.fault) for _, one in ended], dtype=bool),
    )
