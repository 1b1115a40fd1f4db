"""One pass over a recording, and the report that comes of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from shared.config import table_of
from shared.errors import UserError
from shared.messages import CameraGeometry
from shared.rig import RigConfig, rig_of_table
from station.recording.checkup.arm import ArmHealth, ArmWatch
from station.recording.checkup.scale import TOPICS as _SCALE_TOPICS
from station.recording.checkup.scale import ScaleHealth, ScaleWatch
from station.recording.checkup.session import SessionHealth, SessionWatch
from station.recording.checkup.streams import StreamHealth, StreamWatch
from station.recording.for_viewers import TOPICS as FOR_VIEWERS
from station.recording.lost import Lost, lost
from station.recording.numbered import numbered
from station.recording.provenance import whole_number
from station.recording.reader import RecordingReader
from station.rig.agreement import disagreement

_FASTEST_HZ = 1e6
"""No camera is as fast: the number is none, or too large for one."""
_ARM_TOPICS = frozenset({"arm/command", "arm/motion", "arm/platform"})
_SESSION_TOPICS = frozenset({"session/event", "session/sample", "clock", "camera/status", "arm/lease", "log"})


@dataclass(frozen=True, kw_only=True)
class Report:
    """The state of a recording. `recorder` is what the recorder counted (recorded, dropped, missed, duplicates).

    `compression` and `attachments` name what occurs; `unknown` the topics whose schema this version does not know.
    `malformed` are payloads by topic that are no message of it, `changed_metadata` records that were not written so.
    `parts_missing` says which parts of a recording in several files are not there, or hold something else,
    `miscounted` of which topics there are more or fewer messages than the writer counted, `misnumbered` of which some
    are missing by the writer's numbers,
    `other_rig` what the camera agent has otherwise than the rig file in the recording, `scale` how far the mark's side
    contradicts the plate's scale.
    """

    path: str
    mode: str
    duration_s: float
    streams: tuple[StreamHealth, ...]
    session: SessionHealth
    arm: ArmHealth
    recorder: dict[str, int]
    repair: dict[str, str]
    compression: tuple[str, ...]
    metadata: tuple[str, ...]
    attachments: tuple[str, ...]
    unknown: tuple[str, ...]
    malformed: dict[str, int]
    changed_metadata: tuple[str, ...] = ()
    parts_missing: tuple[str, ...] = ()
    miscounted: tuple[str, ...] = ()
    misnumbered: tuple[str, ...] = ()
    other_rig: str = ""
    scale: ScaleHealth = field(default_factory=ScaleHealth)

    @property
    def lost(self) -> Lost:
        """Says what is missing, or too much."""
        return Lost(self.parts_missing, self.miscounted, self.misnumbered)

    def stream(self, topic: str) -> StreamHealth | None:
        """Returns the line of one topic, or None when it does not occur."""
        return next((stream for stream in self.streams if stream.topic == topic), None)


def examine(reader: RecordingReader) -> Report:
    """Reads the whole recording. The simulation's truth is not looked at.

    Raises:
        UserError: if the file is damaged.
    """
    started_ns = whole_number(reader.metadata.get("session", {}).get("started_ns", "")) or reader.start_ns
    streams: dict[str, StreamWatch] = {}
    nominal = {"camera/corners": _camera_rate_hz(reader)}
    session, arm, scale = SessionWatch(), ArmWatch(), ScaleWatch()
    rig, other_rig = _rig(reader), ""
    for item in reader.messages():
        watch = streams.get(item.topic)
        if watch is None:
            watch = StreamWatch(item.topic, start_ns=started_ns, nominal_hz=nominal.get(item.topic))
            streams[item.topic] = watch
        watch.add(item)
        if item.topic in _SCALE_TOPICS:
            scale.add(item)
        if item.topic in _ARM_TOPICS:
            arm.add(item)
        elif item.topic in _SESSION_TOPICS:
            session.add(item)
        elif rig is not None and not other_rig and isinstance(item.message, CameraGeometry):
            other_rig = disagreement(rig, item.message)
    metadata, gone = reader.metadata, lost(reader, numbered(reader))
    recorder = metadata.get("recorder", {}).items()
    counted = {name: number for name, value in recorder if (number := whole_number(value)) is not None}
    return Report(
        path=str(reader.path),
        mode=reader.mode,
        duration_s=reader.duration_s,
        streams=tuple(streams[topic].health() for topic in sorted(streams)),
        session=session.health(),
        arm=arm.health(),
        recorder=counted,
        repair=metadata.get("repair", {}),
        compression=reader.compressions,
        metadata=tuple(metadata),
        attachments=tuple(reader.attachments),
        changed_metadata=reader.changed_metadata,
        parts_missing=gone.parts,
        miscounted=gone.miscounted,
        misnumbered=gone.misnumbered,
        other_rig=other_rig,
        scale=scale.health(),
        unknown=tuple(name for name, info in reader.topics.items() if info.message is None and name not in FOR_VIEWERS),
        malformed=dict(reader.malformed),
    )


def _rig(reader: RecordingReader) -> RigConfig | None:
    """Returns the rig of a session's own file; None for one that is imported, as its camera knew no rig file."""
    if reader.mode == "import" or "rig.toml" not in reader.attachments:
        return None
    try:
        return rig_of_table(table_of(reader.attachments["rig.toml"], "rig.toml"))
    except UserError:
        return None


def _camera_rate_hz(reader: RecordingReader) -> float | None:
    """Returns the frame rate that the recording's own rig file asks for; None when it does not say."""
    try:
        rig = table_of(reader.attachments.get("rig.toml", b""), "rig.toml")
        rate: Any = rig.child("camera").values.get("rate_hz")
    except UserError:
        return None
    return float(rate) if isinstance(rate, int | float) and 0 < rate < _FASTEST_HZ else None
