"""Writes a recording: `NAME.mcap.partial` while it grows, `NAME.mcap` once it is closed.

With a size at which to split it goes on in `NAME.part002.mcap` and so on (`station.recording.parts`).

Compression is lz4: packing a message costs 1.8 µs with it and 3.1 µs with zstd, whose files are smaller by a tenth
(tests/benchmarks/test_recording_speed.py prints both).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from google.protobuf import descriptor_pb2, wrappers_pb2

from shared import topics, wire
from shared.bus import Received
from shared.errors import UserError
from shared.messages import ClockOffset, Message
from station.recording.claim import Claim
from station.recording.counts import METADATA as COUNTS
from station.recording.counts import counts_record
from station.recording.disk import RESERVE_BYTES, free_bytes
from station.recording.for_viewers import for_viewers
from station.recording.growing import GrowingFile
from station.recording.names import Names
from station.recording.parts import (
    BEFORE,
    CONTINUED,
    METADATA,
    NUMBER,
    PARTIAL,
    later_files,
    part_path,
    partial_path,
)
from station.recording.provenance import Provenance
from station.recording.viewers.extra import Extra

FLUSH_EVERY_S = 0.25
"""Half of what kill -9 may cost, so that a busy machine still keeps the promise of half a second."""
MIN_FREE_BYTES = 64 * 1024 * 1024
UNKNOWN_SCHEMA = "google.protobuf.BytesValue"
"""Messages of topics that the table does not know are recorded as they came, wrapped in this schema."""


@dataclass(slots=True)
class _Channel:
    """A topic in the file: its channel number, whose clock its stamps are from, and the next sequence number."""

    number: int
    known: bool
    agent: str
    capture_ns: Callable[[Message], int] = lambda _: 0
    tells_offsets: bool = False
    sequence: int = 0


class Recording:
    """One recording being written, by one thread.

    `publish_time` is the capture time on the station's clock (the sender's stamp plus the newest `ClockOffset` of that
    agent), `log_time` the time of receipt. When the disk is full the file is closed properly, `stopped` holds the
    reason, `on_stopped` is told, and what still comes is counted in `refused`.
    """

    def __init__(
        self,
        path: Path,
        *,
        provenance: Provenance,
        overwrite: bool = False,
        flush_every_s: float = FLUSH_EVERY_S,
        min_free_bytes: int = MIN_FREE_BYTES,
        on_stopped: Callable[[str], None] | None = None,
        split_bytes: int = 0,
    ) -> None:
        """Opens the file and writes where it comes from. A part that has `split_bytes` is the last but one; 0: never.

        Raises:
            UserError: if a recording of this name exists (and `overwrite` is false), or somebody is writing one, the
                folder cannot be written, or the disk has less room than `min_free_bytes`, at which the recording would
                stop at once.
        """
        _require_mcap(path)
        _refuse_full(path, min_free_bytes=min_free_bytes)
        self.path = self._claimed = path
        self.stopped = ""
        self.refused = 0
        self._flush_every_ns = int(flush_every_s * 1e9)
        self._min_free_bytes = min_free_bytes
        self._on_stopped = on_stopped
        self._split_bytes = split_bytes
        self._provenance = provenance
        self._offsets: dict[str, int] = {}
        self._sequences: dict[str, int] = {}
        self._unflushed_since_ns = 0
        self._closed = False
        self._number, self._messages_before = 1, 0
        self._channels: dict[str, _Channel] = {}
        self._claim = Claim(path)
        try:
            refuse_existing(path, overwrite=overwrite)
            self._names = Names(path)
            self._begin(self._new_file(path))
        except BaseException:
            self._claim.release()
            raise

    def _new_file(self, path: Path, **part: str) -> GrowingFile:
        file = GrowingFile(path, self._provenance, part=part)
        self._names.begun(file.unfinished)
        return file

    def _begin(self, file: GrowingFile) -> None:
        """Goes on in this file, which knows nothing yet of the topics."""
        self._file = file
        self._sequences |= {name: channel.sequence for name, channel in self._channels.items()}
        self._channels, self._schemas = {}, dict[str, int]()
        self._for_viewers = for_viewers(self._provenance.rig_toml, own=self._provenance.own_rig)

    def __enter__(self) -> Recording:
        """Returns itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Closes the recording.

        Raises:
            UserError: if it had to stop, or could not be finished, and nothing else went wrong.
        """
        self.close()
        require_recorded(self.stopped if kind is None else "")

    def _go_on(self) -> None:
        """Ends this part and begins the next; where that cannot be begun, this one grows on.

        The next file can be repaired before this one has its name, so that a process killed in between leaves a part
        that breaks off, and not one that is missing.
        """
        path, before = part_path(self._claimed, self._number + 1), self._messages_before + self._file.mcap.messages
        try:
            after = self._new_file(path, **_part(self._number + 1, before))
        except UserError:
            return
        broken = self._finish({METADATA: _part(self._number, self._messages_before) | {CONTINUED: path.name}})
        self._number, self._messages_before = self._number + 1, before
        self._begin(after)
        if broken:
            self._end(f"{broken} {self._finish({})}".rstrip())

    def _finish(self, last: Mapping[str, Mapping[str, str]]) -> str:
        """Finishes the file, its counts at its very end; returns nothing, or a sentence if that fails."""
        path = part_path(self.path, self._number)
        path, broken = self._file.finish({**last, COUNTS: self._counts()}, names=self._names, path=path)
        if self._number == 1:
            self.path = path
        return broken

    def _counts(self) -> dict[str, str]:
        """Returns how many messages this file holds: what a copy of it loses is told by that."""
        counts = {name: channel.sequence - self._sequences.get(name, 0) for name, channel in self._channels.items()}
        return counts_record(counts)

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Adds a record of names and values with a checksum; several of one name are kept, and the last one counts."""
        if self._closed:
            return
        try:
            self._file.add_metadata(name, values)
        except OSError as error:
            self._end(self._file.break_off(error))

    def offset_ns(self, agent: str) -> int:
        """Returns the station's clock minus the agent's clock as last heard; 0 before that."""
        return self._offsets.get(agent, 0)

    def write_message(self, topic: str, message: Message, *, receive_ns: int) -> None:
        """Records a message that did not come over the bus."""
        self.write(Received(topic, receive_ns=receive_ns, message=message))

    def write(self, received: Received) -> None:
        """Records one message as it came."""
        if self._closed:
            self.refused += 1
            return
        try:
            self._add(received)
            if self._file.full:
                self._stop("the disk is full")
        except OSError as error:
            self._end(self._file.break_off(error))

    def _add(self, received: Received) -> None:
        log_ns, payload = received.receive_ns, received.payload
        channel = self._channels.get(received.topic) or self._open_channel(received.topic)
        if not channel.known:
            payload = _wrap(payload)
        publish_ns = self._publish_ns(received, channel)
        self._put(channel, payload, log_ns=log_ns, publish_ns=publish_ns)
        if self._for_viewers is not None and received.topic in self._for_viewers.takes:
            self._add_for_viewers(received, publish_ns)
        if not self._unflushed_since_ns:
            self._unflushed_since_ns = log_ns
        elif log_ns - self._unflushed_since_ns >= self._flush_every_ns:
            self.flush()

    def _put(self, channel: _Channel, payload: bytes, *, log_ns: int, publish_ns: int) -> None:
        sequence = channel.sequence
        channel.sequence = sequence + 1
        self._file.mcap.add_message(
            channel.number, log_ns=log_ns, publish_ns=publish_ns, sequence=sequence, payload=payload
        )

    def _add_for_viewers(self, received: Received, publish_ns: int) -> None:
        assert self._for_viewers is not None
        try:
            extras = tuple(self._for_viewers.follow(received.topic, received.message, stamp_ns=publish_ns))
        except (UserError, ArithmeticError, ValueError):  # numbers that make no sense: recorded, and not drawn
            return
        for extra in extras:
            channel = self._channels.get(extra.topic) or self._open_channel_for_viewers(extra)
            self._put(channel, extra.payload, log_ns=received.receive_ns, publish_ns=publish_ns)

    def _open_channel_for_viewers(self, extra: Extra) -> _Channel:
        kind = extra.schema
        schema = self._file.mcap.register_schema(kind.name, kind.definition, encoding=kind.encoding)
        number = self._file.mcap.register_channel("/" + extra.topic, schema_id=schema, encoding=kind.message_encoding)
        sequence = self._sequences.get(extra.topic, 0)
        self._channels[extra.topic] = channel = _Channel(number, known=True, agent="", sequence=sequence)
        return channel

    def _publish_ns(self, received: Received, channel: _Channel) -> int:
        if not channel.known:
            return received.receive_ns
        try:
            message = received.message
        except UserError:  # recorded as it came all the same; the doctor names it
            return received.receive_ns
        if channel.tells_offsets and isinstance(message, ClockOffset):
            self._offsets[message.agent] = message.offset_ns
        stamp_ns = channel.capture_ns(message)
        if stamp_ns <= 0:
            return received.receive_ns
        return max(0, stamp_ns + self._offsets.get(channel.agent, 0)) if channel.agent else stamp_ns

    def _open_channel(self, name: str) -> _Channel:
        try:
            line = topics.topic(name)
        except UserError:
            number = self._register(name, UNKNOWN_SCHEMA, _wrapper_schema())
            channel = _Channel(number, known=False, agent="")
        else:
            number = self._register(name, wire.schema_name(line.message), wire.schema(line.message))
            agent = line.sender if line.sender in ("camera", "arm") else ""
            channel = _Channel(
                number,
                known=True,
                agent=agent,
                capture_ns=topics.capture_of(line.message),
                tells_offsets=line.message is ClockOffset,
            )
        channel.sequence = self._sequences.get(name, 0)
        self._channels[name] = channel
        return channel

    def _register(self, name: str, schema: str, data: bytes) -> int:
        if schema not in self._schemas:
            self._schemas[schema] = self._file.mcap.register_schema(schema, data)
        return self._file.mcap.register_channel("/" + name, schema_id=self._schemas[schema])

    def flush(self) -> None:
        """Hands everything to the operating system, so that a killed process no longer loses it."""
        self._unflushed_since_ns = 0
        self._file.mcap.flush()
        if free_bytes(self.path.parent) < self._min_free_bytes:
            self._stop("the disk is full")
        elif 0 < self._split_bytes <= self._file.size_bytes:
            self._go_on()

    def flush_if_due(self, now_ns: int) -> None:
        """Flushes what has waited too long; call it when nothing comes."""
        if self._closed or not self._unflushed_since_ns:
            return
        if now_ns - self._unflushed_since_ns < self._flush_every_ns:
            return
        try:
            self.flush()
            if self._file.full:
                self._stop("the disk is full")
        except OSError as error:
            self._end(self._file.break_off(error))

    def _stop(self, reason: str) -> None:
        """Closes the file properly before its time."""
        if not self._closed:
            self._closed = True
            self._end(
                self._finish({}) or f"The recording stopped because {reason}: {self.path} holds everything until then"
            )

    def _end(self, stopped: str) -> None:
        """Takes nothing more; tells why, unless it is because all is there."""
        self._closed, self.stopped = True, stopped
        self._claim.release()
        if stopped and self._on_stopped is not None:
            self._on_stopped(stopped)

    def let_go(self) -> None:
        """Writes nothing more here: another process, born from this one, goes on with the recording."""
        self._closed = True
        self._file.let_go()
        self._claim.let_go()

    def close(self) -> Path:
        """Finishes the file and gives it its name, which is returned; closing twice is harmless.

        `stopped` says if that failed.
        """
        if not self._closed:
            self._closed = True
            self._end(self._finish({}))
        return self.path


def _part(number: int, messages_before: int) -> dict[str, str]:
    return {NUMBER: str(number), BEFORE: str(messages_before)}


def require_recorded(stopped: str) -> None:
    """Raises UserError if a recording had to stop, for the reason given: whoever asked for it has not got it whole."""
    if stopped:
        raise UserError(stopped)


def refuse_existing(path: Path, *, overwrite: bool = False) -> None:
    """Raises UserError if no new recording can have that name."""
    _require_mcap(path)
    if overwrite:
        return
    finished = [later for later in later_files(path) if later.suffix != PARTIAL]
    for there in (path, *finished):
        if there.exists():
            raise UserError(
                f"Expected a new name for the recording, but {there} exists; choose another one or move it away"
            )
    for left in (partial_path(path), *later_files(path)):
        if left.exists():
            raise UserError(
                f"Expected a new name for the recording, but {left} was left by a session that broke off; "
                f"run: station repair {left}"
            )


def _require_mcap(path: Path) -> None:
    if path.suffix != ".mcap":
        raise UserError(f"Expected a recording's name to end in .mcap, got '{path.name}'; call it {path.name}.mcap")


def _refuse_full(path: Path, *, min_free_bytes: int) -> None:
    folder = path.parent if path.parent.is_dir() else path.parent.parent
    if not folder.is_dir():
        return  # opening the file says it better
    if (free := free_bytes(folder)) < min_free_bytes + RESERVE_BYTES:
        raise UserError(
            f"Expected at least {(min_free_bytes + RESERVE_BYTES) / 1e6:.0f} MB of room to record into {folder}, got "
            f"{free / 1e6:.0f} MB; free some space or choose another folder"
        )


def _wrap(payload: bytes) -> bytes:
    return wrappers_pb2.BytesValue(value=payload).SerializeToString()


def _wrapper_schema() -> bytes:
    file = descriptor_pb2.FileDescriptorProto.FromString(wrappers_pb2.DESCRIPTOR.serialized_pb)
    return descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString(deterministic=True)
