"""A recording's messages as arrays (`station.signals`): the whole of it, a stretch of time, or run after run.

Times are the recorded publish times: capture times on the station's clock. Messages that came late are put in their
place. The memory needed is twice that of the arrays, of which a frame takes 144 bytes and an attitude 88; run after
run (`run_signals`) it is that of one run.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shared.geometry import Array
from shared.messages import (
    CameraGeometry,
    Environment,
    MarkerCorners,
    Message,
    MotionReport,
    RunEvent,
    Sample,
    TiltCommand,
)
from shared.topics import ANGLE_PREFIX
from station.recording import columns
from station.recording.columns import Columns
from station.recording.reader import Recorded, RecordingReader
from station.signals.session import Signals
from station.signals.tracks import CommandTrack, EnvironmentTrack, EventTrack, MotionTrack

LATE_NS = 30_000_000_000
"""A recovered message may come this much after its capture (the cache of the corners' publisher)."""
_AROUND_NS = 1_000_000_000
_TOPICS = (
    *("camera/corners", "camera/plate", "camera/geometry", "block/pose", "arm/platform", "arm/command", "arm/motion"),
    *("session/event", "session/sample", "environment"),
)
_Rows = list[tuple[int, Any]]


def load_signals(reader: RecordingReader, *, from_ns: int | None = None, to_ns: int | None = None) -> Signals:
    """The signals with from_ns ≤ capture time < to_ns; everything by default.

    The newest calibration of that stretch counts, or else the first of the recording.

    Raises:
        UserError: if the file is damaged.
    """
    collected = _Collected()
    topics = [*_TOPICS, *(name for name in reader.topics if name.startswith(ANGLE_PREFIX))]
    first_ns = None if from_ns is None else from_ns - _AROUND_NS
    last_ns = None if to_ns is None else to_ns + LATE_NS
    for item in reader.messages(topics, first_ns, last_ns):
        if (from_ns is None or item.publish_ns >= from_ns) and (to_ns is None or item.publish_ns < to_ns):
            collected.add(item)
    if collected.geometry is None:
        for item in reader.messages({"camera/geometry"}):
            collected.add(item)
            break
    return collected.signals()


def run_signals(reader: RecordingReader, *, around_ns: int = _AROUND_NS) -> Iterator[tuple[int, Signals]]:
    """Each run's number and signals, from `around_ns` before its first event to as long after its last."""
    spans: dict[int, tuple[int, int]] = {}
    for item in reader.messages({"session/event"}):
        event = item.message
        if isinstance(event, RunEvent) and event.phase != "SYNC":
            first, last = spans.get(event.run, (item.publish_ns, item.publish_ns))
            spans[event.run] = (min(first, item.publish_ns), max(last, item.publish_ns))
    samples = reader.samples()
    for run, (first, last) in spans.items():
        part = load_signals(reader, from_ns=first - around_ns, to_ns=last + around_ns)
        yield run, replace(part, samples=tuple(sample for sample in samples if sample.run == run))


class _Collected:
    """What has been read so far."""

    def __init__(self) -> None:
        self.geometry: CameraGeometry | None = None
        self._corners = columns.corner_columns()
        self._fiducials: defaultdict[int, Columns] = defaultdict(columns.corner_columns)
        self._block = columns.pose_columns()
        self._attitude = columns.attitude_columns()
        self._angles: defaultdict[str, Columns] = defaultdict(columns.angle_columns)
        self._rare: defaultdict[str, _Rows] = defaultdict(list)

    def add(self, item: Recorded) -> None:
        time_ns, message = item.publish_ns, item.message
        if isinstance(message, MarkerCorners):
            block = item.topic == "camera/corners"
            (self._corners if block else self._fiducials[message.marker_id]).add(time_ns, message)
        elif item.topic == "arm/platform":
            self._attitude.add(time_ns, message)
        elif item.topic == "block/pose":
            self._block.add(time_ns, message)
        elif item.topic.startswith(ANGLE_PREFIX):
            self._angles[item.topic.removeprefix(ANGLE_PREFIX)].add(time_ns, message)
        elif isinstance(message, CameraGeometry):
            self.geometry = message
        else:
            self._rare[item.topic].append((time_ns, message))

    def signals(self) -> Signals:
        for rows in self._rare.values():
            rows.sort(key=_time_ns)
        fiducials, angles = sorted(self._fiducials.items()), sorted(self._angles.items())
        return Signals(
            corners=columns.corner_track(self._corners),
            fiducials={number: columns.corner_track(found) for number, found in fiducials},
            block=columns.pose_track(self._block),
            attitude=columns.attitude_track(self._attitude),
            commands=_commands(self._rare["arm/command"]),
            motions=_motions(self._rare["arm/motion"]),
            events=_events(self._rare["session/event"]),
            environment=_environment(self._rare["environment"]),
            angles={source: columns.angle_track(found) for source, found in angles},
            geometry=self.geometry,
            samples=tuple(row for _, row in self._rare["session/sample"] if isinstance(row, Sample)),
        )


def _time_ns(row: tuple[int, Message]) -> int:
    return row[0]


def _times(rows: Sequence[tuple[int, Any]]) -> NDArray[np.int64]:
    return np.array([time_ns for time_ns, _ in rows], dtype=np.int64)


def _column(rows: _Rows, pick: Callable[[Any], Any], dtype: Any) -> NDArray[Any]:
    return np.array([pick(message) for _, message in rows], dtype=dtype)


def _commands(rows: _Rows) -> CommandTrack:
    def command(pick: Callable[[TiltCommand], float], dtype: Any) -> NDArray[Any]:
        return _column(rows, pick, dtype)

    return CommandTrack(
        time_ns=_times(rows),
        run=command(lambda message: message.run, np.int64),
        direction=command(lambda message: message.direction, np.int64),
        azimuth_rad=command(lambda message: message.azimuth_rad, float),
        angle_rad=command(lambda message: message.angle_rad, float),
        step=command(lambda message: message.step, np.int64),
        rate_rad_s=command(lambda message: message.rate_rad_s, float),
    )


def _motions(rows: _Rows) -> MotionTrack:
    """Begin and end stand in the agent's clock inside the message; its publish time says how far that is off."""
    ended: _Rows = []
    ends: list[int] = []
    for publish_ns, report in rows:
        if isinstance(report, MotionReport) and report.end_ns:
            offset_ns = publish_ns - report.stamp_ns
            ended.append((report.begin_ns + offset_ns, report))
            ends.append(report.end_ns + offset_ns)
    order = np.argsort(_times(ended), kind="stable")
    return MotionTrack(
        time_ns=_times(ended)[order],
        end_ns=np.array(ends, dtype=np.int64)[order],
        run=_column(ended, lambda message: message.run, np.int64)[order],
        step=_column(ended, lambda message: message.step, np.int64)[order],
        failed=_column(ended, lambda message: bool(message.fault), bool)[order],
    )


def _events(rows: _Rows) -> EventTrack:
    return EventTrack(
        time_ns=_times(rows),
        run=_column(rows, lambda event: event.run, np.int64),
        phase=_column(rows, lambda event: event.phase, np.str_),
        step=_column(rows, lambda event: event.step, np.int64),
        reason=_column(rows, lambda event: event.reason, np.str_),
    )


def _environment(rows: _Rows) -> EnvironmentTrack:
    def value(pick: Callable[[Environment], float]) -> Array:
        return _column(rows, pick, float)

    return EnvironmentTrack(
        time_ns=_times(rows),
        temperature_c=value(lambda message: message.temperature_c),
        relative_humidity=value(lambda message: message.relative_humidity),
    )
