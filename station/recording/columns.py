"""Messages of one topic, collected as columns of numbers: a message object takes five times the room of its figures."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shared import wire
from shared.errors import UserError
from shared.geometry import Array
from shared.messages import (
    AngleReading,
    BlockPose,
    Environment,
    MarkerCorners,
    Message,
    MotionReport,
    PlatformState,
    RunEvent,
    TiltCommand,
)
from shared.possible import FARTHEST_M, LARGEST, LONGEST, SHORTEST
from station.recording.unpacking import Integers, Payloads, fields_of
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

Named = Mapping[str, Any]
"""Columns by the field's name, each with as many rows."""

JOINED_AT = 8
"""Parts are joined when what came since is an eighth of what was joined: each number is copied nine times at most.

Small parts of a long session, freed all at once, would leave as much free memory as its signals take, which is not
given back.
"""

LETTERS = 256
"""Letters of a text that are kept: a sentence has fewer, and a stranger's text may have millions."""

_CORNERS = {"corners_px": 8, "sigma_px": 0, "corner_dt_ns": 4, "seq": 0, "boot_id": 0, "found": 0, "tipped": 0}
_NAMES: Mapping[type[Message], Mapping[str, int]] = {
    MarkerCorners: {**_CORNERS, "marker_id": 0},
    BlockPose: dict.fromkeys(("x", "y", "z", "qw", "qx", "qy", "qz", "sigma_m", "sigma_rad", "found"), 0),
    PlatformState: dict.fromkeys(("qw", "qx", "qy", "qz", "wx", "wy", "wz", "px", "py", "pz"), 0),
    AngleReading: dict.fromkeys(("angle_rad", "sigma_rad", "gravity_x", "gravity_y", "gravity_z"), 0),
    TiltCommand: dict.fromkeys(("run", "direction", "azimuth_rad", "angle_rad", "step", "rate_rad_s"), 0),
    MotionReport: dict.fromkeys(("stamp_ns", "run", "step", "begin_ns", "end_ns", "fault"), 0),
    RunEvent: dict.fromkeys(("run", "phase", "reason", "step"), 0),
    Environment: dict.fromkeys(("temperature_c", "relative_humidity"), 0),
}
"""The fields that the tracks need, with the length of a list (0: no list)."""


class Columns:
    """Takes what is wanted of the messages of one class, chunk by chunk."""

    def __init__(self, cls: type[Message]) -> None:
        self._cls, self._names = cls, _NAMES[cls]
        self._parts = list[dict[str, Any]]()
        self._joined = self._since = 0

    def add(self, payloads: Payloads, *, log_ns: Integers, publish_ns: Integers) -> NDArray[np.bool_]:
        """Takes messages (n,) as they stand in the file; True (n,) for those taken, which are of this class.

        Args:
            payloads: the messages as they stand in the file.
            log_ns: (n,) when the messages were logged, ns.
            publish_ns: (n,) when they were published, ns.
        """
        fields = fields_of(self._cls, payloads, names=self._names)
        good = np.ones(len(log_ns), dtype=bool)
        odd = ~fields.understood | (payloads.begin == payloads.end) | _odd(fields.values, len(log_ns))
        for number in np.flatnonzero(odd).tolist():
            try:
                message = wire.decode(self._cls, payloads.bytes(number))
            except UserError:
                good[number] = False
                continue
            for name, width in self._names.items():
                fields.values[name][number] = _kept(getattr(message, name), fields.values[name], width)
        part = {"log_ns": log_ns, "publish_ns": publish_ns, **fields.values}
        if not good.all():
            part = {name: _taken(column, np.flatnonzero(good)) for name, column in part.items()}
        self._parts.append(part)
        self._since += len(log_ns)
        if self._since * JOINED_AT > self._joined:
            self._parts = [self._whole()]
            self._joined, self._since = self._joined + self._since, 0
        return good

    def _whole(self) -> dict[str, Any]:
        """Returns all columns by name, one after another: the parts of each go as it is joined."""
        return {name: _joined([part.pop(name) for part in self._parts], width) for name, width in self._all()}

    def sorted(self) -> Named:
        """Returns all columns by name, and `publish_ns`: in the order of that, and equal ones as they came."""
        columns = self._whole()
        for key in ("log_ns", "publish_ns"):
            if np.any(np.diff(columns[key]) < 0):
                order = np.argsort(columns[key], kind="stable")
                columns = {name: _taken(column, order) for name, column in columns.items()}
        return columns

    def _all(self) -> list[tuple[str, int]]:
        return [("log_ns", 0), ("publish_ns", 0), *self._names.items()]


def _odd(values: Named, count: int) -> NDArray[np.bool_]:
    """Returns true (n,) for what may be impossible (`Message.impossible`).

    That is a number or a pivot beyond all rigs, or an attitude that is none.
    """
    odd = np.zeros(count, dtype=bool)
    for column in values.values():
        if isinstance(column, np.ndarray) and column.dtype.kind == "f":
            odd |= ~(np.abs(column.reshape(count, -1)) <= LARGEST).all(axis=1)
    for name in {"px", "py", "pz"} & values.keys():
        odd |= ~(np.abs(values[name]) <= FARTHEST_M)
    if "qw" in values:
        with np.errstate(over="ignore"):
            square = sum(values[name] ** 2 for name in ("qw", "qx", "qy", "qz"))
        odd |= np.logical_not((square >= SHORTEST**2) & (square <= LONGEST**2))
    return odd


def _kept(value: Any, column: Any, width: int) -> Any:
    """Returns a field of a message, as the column has it: a text without what is beyond `LETTERS`.

    Lists of another length are nan, or 0 for whole numbers.
    """
    if isinstance(value, str):
        return value[:LETTERS]
    if not width or len(value) == width:
        return value
    return math.nan if column.dtype.kind == "f" else 0


def _joined(parts: list[Any], width: int) -> Any:
    if parts and isinstance(parts[0], list):
        return [text for part in parts for text in part]
    return np.concatenate(parts) if parts else np.empty((0, width) if width else 0)


def _taken(column: Any, order: NDArray[np.intp]) -> Any:
    return [column[index] for index in order.tolist()] if isinstance(column, list) else column[order]


def _whole(column: Any) -> Integers:
    return np.asarray(column, dtype=np.int64)


def _stacked(columns: Named, names: str) -> Array:
    """Returns columns side by side (n, k), nan if there are no rows."""
    return np.column_stack([np.asarray(columns[name], dtype=float) for name in names.split()])


# --- tracks ---------------------------------------------------------------------------------------------------------


def corner_tracks(columns: Columns) -> dict[int, CornerTrack]:
    """Returns the track of each marker by its number."""
    rows = columns.sorted()
    numbers = _whole(rows["marker_id"])
    whole = _corner_track(rows)
    found = sorted(set(numbers.tolist()))
    if len(found) < 2:
        return dict.fromkeys(found, whole)
    return {number: whole.select(np.flatnonzero(numbers == number)) for number in found}


def corner_track(columns: Columns) -> CornerTrack:
    """Returns the track of the one marker that they are all of."""
    return _corner_track(columns.sorted())


def _corner_track(rows: Named) -> CornerTrack:
    found = np.asarray(rows["found"], dtype=bool)
    pixels = np.asarray(rows["corners_px"], dtype=float)
    if not found.all():
        pixels[~found] = np.nan
    return CornerTrack(
        time_ns=_whole(rows["publish_ns"]),
        corner_px=pixels.reshape(-1, 4, 2),
        sigma_px=np.asarray(rows["sigma_px"], dtype=float),
        corner_dt_ns=_whole(rows["corner_dt_ns"]),
        seq=_whole(rows["seq"]),
        boot_id=_whole(rows["boot_id"]),
        found=found,
        tipped=np.asarray(rows["tipped"], dtype=bool),
    )


def pose_track(columns: Columns) -> PoseTrack:
    """Returns the block's track by another tracker."""
    rows = columns.sorted()
    found = np.asarray(rows["found"], dtype=bool)
    position, turn = _stacked(rows, "x y z"), _stacked(rows, "qw qx qy qz")
    position[~found], turn[~found] = np.nan, np.nan
    return PoseTrack(
        time_ns=_whole(rows["publish_ns"]),
        position_m=position,
        quaternion=turn,
        sigma_m=np.asarray(rows["sigma_m"], dtype=float),
        sigma_rad=np.asarray(rows["sigma_rad"], dtype=float),
        found=found,
    )


def attitude_track(columns: Columns) -> AttitudeTrack:
    """Returns the plate's track."""
    rows = columns.sorted()
    return AttitudeTrack(
        time_ns=_whole(rows["publish_ns"]),
        quaternion=_stacked(rows, "qw qx qy qz"),
        rate_rad_s=_stacked(rows, "wx wy wz"),
        pivot_m=_stacked(rows, "px py pz"),
    )


def angle_track(columns: Columns) -> AngleTrack:
    """Returns the track of another angle sensor."""
    rows = columns.sorted()
    return AngleTrack(
        time_ns=_whole(rows["publish_ns"]),
        angle_rad=np.asarray(rows["angle_rad"], dtype=float),
        sigma_rad=np.asarray(rows["sigma_rad"], dtype=float),
        gravity=_stacked(rows, "gravity_x gravity_y gravity_z"),
    )


def command_track(columns: Columns) -> CommandTrack:
    """Returns the commands to the arm."""
    rows = columns.sorted()
    return CommandTrack(
        time_ns=_whole(rows["publish_ns"]),
        run=_whole(rows["run"]),
        direction=_whole(rows["direction"]),
        azimuth_rad=np.asarray(rows["azimuth_rad"], dtype=float),
        angle_rad=np.asarray(rows["angle_rad"], dtype=float),
        step=_whole(rows["step"]),
        rate_rad_s=np.asarray(rows["rate_rad_s"], dtype=float),
    )


def motion_track(columns: Columns) -> MotionTrack:
    """Returns the motions that ended.

    Begin and end stand in the agent's clock inside the message; its publish time says how far that is off.
    """
    rows = columns.sorted()
    publish, stamp, begin, end, run, step = (
        _whole(rows[name]) for name in ("publish_ns", "stamp_ns", "begin_ns", "end_ns", "run", "step")
    )
    offset = publish - stamp
    ended = np.flatnonzero(end)
    ended = ended[np.argsort((begin + offset)[ended], kind="stable")]
    return MotionTrack(
        time_ns=(begin + offset)[ended],
        end_ns=(end + offset)[ended],
        run=run[ended],
        step=step[ended],
        failed=np.array([bool(fault) for fault in rows["fault"]], dtype=bool)[ended],
    )


def event_track(columns: Columns) -> EventTrack:
    """Returns the phases of the runs."""
    rows = columns.sorted()
    return EventTrack(
        time_ns=_whole(rows["publish_ns"]),
        run=_whole(rows["run"]),
        phase=np.array(list(rows["phase"]), dtype=object),
        step=_whole(rows["step"]),
        reason=np.array(list(rows["reason"]), dtype=object),
    )


def environment_track(columns: Columns) -> EnvironmentTrack:
    """Returns the air around the rig."""
    rows = columns.sorted()
    return EnvironmentTrack(
        time_ns=_whole(rows["publish_ns"]),
        temperature_c=np.asarray(rows["temperature_c"], dtype=float),
        relative_humidity=np.asarray(rows["relative_humidity"], dtype=float),
    )
