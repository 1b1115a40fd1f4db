"""A recording's messages as arrays (`station.signals`): the whole of it, a stretch of time, or run after run.

Times are the recorded publish times: capture times on the station's clock. Messages that came late are put in their
place. The memory needed is twice that of the arrays, of which a frame takes 144 bytes and an attitude 88; run after
run (`run_signals`) it is that of one run.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from shared import wire
from shared.errors import UserError
from shared.messages import (
    AngleReading,
    BlockPose,
    CameraGeometry,
    Environment,
    MarkerCorners,
    Message,
    MotionReport,
    PlatformState,
    RunEvent,
    Sample,
    TiltCommand,
)
from shared.topics import ANGLE_PREFIX
from station.recording import columns
from station.recording.batches import Batch
from station.recording.columns import Columns
from station.recording.reader import RecordingReader, TopicInfo
from station.signals.session import Signals

LATE_NS = 30_000_000_000
"""A recovered message may come this much after its capture (the cache of the corners' publisher)."""
_AROUND_NS = 1_000_000_000
_TRACKS: dict[str, type[Message]] = {
    "camera/corners": MarkerCorners,
    "camera/plate": MarkerCorners,
    "block/pose": BlockPose,
    "arm/platform": PlatformState,
    "arm/command": TiltCommand,
    "arm/motion": MotionReport,
    "session/event": RunEvent,
    "environment": Environment,
}
_WHOLE: dict[str, type[Message]] = {"camera/geometry": CameraGeometry, "session/sample": Sample}
"""Topics of few messages, which are kept as they are."""


def load_signals(reader: RecordingReader, *, from_ns: int | None = None, to_ns: int | None = None) -> Signals:
    """Loads the signals with from_ns ≤ capture time < to_ns; everything by default.

    The newest calibration of that stretch counts, or else the first of the recording.

    Raises:
        UserError: if the file is damaged.
    """
    collected = _Collected(reader)
    topics = [*_TRACKS, *_WHOLE, *(name for name in reader.topics if name.startswith(ANGLE_PREFIX))]
    for name in topics:
        if name in reader.topics:
            _refuse_other(reader.topics[name])
    first_ns = None if from_ns is None else from_ns - _AROUND_NS
    last_ns = None if to_ns is None else to_ns + LATE_NS
    for channels, batch in reader.batches(topics, first_ns, last_ns):
        inside = np.ones(len(batch.channel), dtype=bool)
        if from_ns is not None:
            inside &= batch.publish_ns >= from_ns
        if to_ns is not None:
            inside &= batch.publish_ns < to_ns
        collected.add(channels, batch if inside.all() else batch.select(inside))
    signals = collected.signals()
    if signals.geometry is not None:
        return signals
    return replace(signals, geometry=first_geometry(reader))


def first_geometry(reader: RecordingReader) -> CameraGeometry | None:
    """Returns the first calibration of a recording; a session has one."""
    return next(_calibrations(item.message for item in reader.messages({"camera/geometry"})), None)


def _calibrations(messages: Iterable[Message]) -> Iterator[CameraGeometry]:
    for message in messages:
        if isinstance(message, CameraGeometry) and (found := message.if_calibrated()):
            yield found


def run_signals(reader: RecordingReader, *, around_ns: int = _AROUND_NS) -> Iterator[tuple[int, Signals]]:
    """Yields each run's number and signals, from `around_ns` before its first event to as long after its last."""
    spans: dict[int, tuple[int, int]] = {}
    for item in reader.messages({"session/event"}):
        event = item.message
        if isinstance(event, RunEvent) and event.phase != "SYNC":
            first, last = spans.get(event.run, (item.publish_ns, item.publish_ns))
            spans[event.run] = (min(first, item.publish_ns), max(last, item.publish_ns))
    samples = tuple(sample for sample in reader.samples() if not sample.disturbed)
    for run, (first, last) in spans.items():
        part = load_signals(reader, from_ns=first - around_ns, to_ns=last + around_ns)
        yield run, replace(part, samples=tuple(sample for sample in samples if sample.run == run))


class _Collected:
    """The arrays of what has been read so far."""

    def __init__(self, reader: RecordingReader) -> None:
        self._reader = reader
        self._columns: dict[str, Columns] = {name: Columns(cls) for name, cls in _TRACKS.items()}
        self._angles: defaultdict[str, Columns] = defaultdict(lambda: Columns(AngleReading))
        self._messages: dict[str, list[tuple[int, int, Message]]] = {name: [] for name in _WHOLE}

    def add(self, channels: dict[int, TopicInfo], batch: Batch) -> None:
        """Takes the messages of a chunk."""
        topics = dict[str, list[int]]()
        for number in np.unique(batch.channel).tolist():
            info = channels[number]
            topics.setdefault(info.name, []).append(number)
        for topic, numbers in topics.items():
            part = batch.select(np.isin(batch.channel, numbers))
            if topic in _WHOLE:
                self._messages[topic] += self._reader.decoded(topic, part, _WHOLE[topic])
            else:
                own = self._columns.get(topic) or self._angles[topic.removeprefix(ANGLE_PREFIX)]
                taken = own.add(part.payloads, log_ns=part.log_ns, publish_ns=part.publish_ns)
                self._reader.leave_out(topic, part.offset[~taken].tolist())

    def signals(self) -> Signals:
        """Returns all of it, in the order of capture."""
        geometries = [*_calibrations(each for *_, each in sorted(self._messages["camera/geometry"], key=_log_ns))]
        samples = sorted(sorted(self._messages["session/sample"], key=_log_ns), key=_publish_ns)
        own = self._columns
        return Signals(
            corners=columns.corner_track(own["camera/corners"]),
            fiducials=columns.corner_tracks(own["camera/plate"]),
            block=columns.pose_track(own["block/pose"]),
            attitude=columns.attitude_track(own["arm/platform"]),
            commands=columns.command_track(own["arm/command"]),
            motions=columns.motion_track(own["arm/motion"]),
            events=columns.event_track(own["session/event"]),
            environment=columns.environment_track(own["environment"]),
            angles={source: columns.angle_track(found) for source, found in sorted(self._angles.items())},
            geometry=geometries[-1] if geometries else None,
            samples=tuple(sample for *_, sample in samples if isinstance(sample, Sample) and not sample.disturbed),
        )


def _refuse_other(info: TopicInfo) -> None:
    """Refuses a topic that carries something else than its message, which would be read as nonsense."""
    expected = _TRACKS.get(info.name) or _WHOLE.get(info.name) or AngleReading
    if info.message is not expected:
        raise UserError(f"Expected {wire.schema_name(expected)} on the topic {info.name}, got {info.schema}")


def _log_ns(row: tuple[int, int, Message]) -> int:
    return row[0]


def _publish_ns(row: tuple[int, int, Message]) -> int:
    return row[1]
