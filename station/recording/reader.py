"""Reads a recording in bounded memory: a few chunks at a time, every checksum checked.

Topics are named as on the bus (`camera/corners`), without the slash that they have in the file. `/truth/**`, which
simulated sessions may hold, is handed out only when asked for by name: nothing that measures, analyses or diagnoses
may see it.
"""

from __future__ import annotations

import hashlib
import io
import logging
import struct
import zlib
from bisect import bisect_left
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from operator import itemgetter
from pathlib import Path
from typing import BinaryIO, TypeVar

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.records import Attachment, Chunk, ChunkIndex, MetadataIndex
from mcap.summary import Summary

from shared import topics, wire
from shared.bus import Received
from shared.errors import UserError
from shared.messages import AngleReading, Message, Sample
from shared.visible import visible
from station.recording.batches import Batch, Unpacked, batch_by_walking, batch_of
from station.recording.bounded import BROKEN, read_at, require_unpacked_within
from station.recording.chunks import HELD_BYTES, DamageError, RawMessage, messages, unpack
from station.recording.described import Described, Found, described, record_at
from station.recording.for_viewers import TOPICS as FOR_VIEWERS
from station.recording.index import FOOTER_BYTES, read_index
from station.recording.mcap_file import MAGIC
from station.recording.parts import number_of, part_path
from station.recording.writer import PARTIAL

M = TypeVar("M", bound=Message)
_LOG = logging.getLogger(__name__)
TRUTH = "truth/"
LATEST_NS = 2**63 - 1
"""The year 2262: what is stamped later is no message. The format has a bit more than any clock or reader."""
_CLASSES = {wire.schema_name(line.message): line.message for line in topics.TOPICS.values()} | {
    wire.schema_name(AngleReading): AngleReading
}
MAX_HELD_BYTES = 256 * 1024 * 1024
"""The size of messages that wait until no later chunk can hold an earlier one: one chunk of our own recordings."""
MOST_SAMPLES = 200_000
"""Ten times the longest session, of 20 000 runs; as objects they take 250 MB, which a file of some kB may ask for."""
_TOGETHER_BYTES = 1 << 20
"""Chunks smaller than this are read together, where whole columns are wanted."""


@dataclass(frozen=True, slots=True)
class TopicInfo:
    """A topic of a recording; `message` is None when this version does not know the schema."""

    name: str
    schema: str
    message: type[Message] | None
    count: int


class Recorded:
    """A message as it was recorded. `publish_ns`: when it happened; `log_ns`: when the station received it."""

    __slots__ = ("log_ns", "message", "payload", "publish_ns", "topic")

    def __init__(self, topic: str, *, payload: bytes, message: Message, publish_ns: int, log_ns: int) -> None:
        self.topic = topic
        self.payload = payload
        self.message = message
        self.publish_ns = publish_ns
        self.log_ns = log_ns

    @property
    def received(self) -> Received:
        """The message as it came over the bus: what a replay hands to the live pipeline."""
        return Received(self.topic, self.log_ns, self.message, payload=self.payload)


def open_recording(path: Path) -> RecordingReader:
    """Opens a finished recording, with the parts in which it goes on; a later part alone, if that is named.

    Raises:
        UserError: in one sentence, if there is none, or it is empty, cut off, damaged or something else.
    """
    from station.recording.parted import PartedReader, continued_in  # noqa: PLC0415  # it reads by what is in this file

    path = Path(path)
    first = open_file(path)
    parts, missing = [first], ""
    while number_of(path.name) == 1 and (name := continued_in(parts[-1])) and not missing:
        after = part_path(path, len(parts) + 1)
        if after.exists():
            parts.append(open_file(after))
        elif (broken := after.with_name(after.name + PARTIAL)).exists():
            raise UserError(f"Expected a finished recording, but {broken} breaks off; run: station repair {broken}")
        else:
            missing = f"{path} goes on in {after.name} (written as {visible(name)}), which is not beside it"
            _LOG.warning("%s: what is in it is left out", missing)
    return PartedReader(parts, missing=missing) if len(parts) > 1 or missing else first


def open_file(path: Path) -> RecordingReader:
    """Opens one finished file alone, whether it goes on in another or not.

    Raises:
        UserError: as `open_recording` does.
    """
    try:
        with path.open("rb") as file:
            _check_ends(file, path)
            summary = read_index(file)
            _require_bounded(file, summary)
    except OSError as error:
        raise UserError(f"Expected a recording at {path}, but it cannot be read: {error.strerror}") from error
    except BROKEN as error:
        raise _damaged(path, str(error) or type(error).__name__) from error
    counted = summary.statistics if summary is not None else None
    # Messages outside of chunks, which are not indexed, would otherwise be silently no messages.
    if summary is None or counted is None or (counted.message_count and not summary.chunk_indexes):
        raise UserError(f"Expected a recording with an index, but {path} has none; run: station repair {path}")
    return RecordingReader(path, summary)


def _require_bounded(file: BinaryIO, summary: Summary | None) -> None:
    """Refuses an index by which a small file would hold any amount: packed too well, or read again and again."""
    indexes = [] if summary is None else sorted(summary.chunk_indexes, key=lambda index: index.chunk_start_offset)
    require_unpacked_within(indexes, file_bytes=file.seek(0, 2))
    end = 0
    for index in indexes:
        if index.chunk_start_offset < end:
            raise DamageError(f"its chunks overlap (at byte {index.chunk_start_offset})")
        end = index.chunk_start_offset + index.chunk_length


def _check_ends(file: BinaryIO, path: Path) -> None:
    start = file.read(len(MAGIC))
    if not start:
        raise UserError(f"Expected a recording, but {path} is empty")
    if start != MAGIC:
        raise UserError(f"Expected a recording (MCAP), but {path} is another kind of file")
    size = file.seek(0, 2)
    file.seek(max(0, size - len(MAGIC)))
    if size < 2 * len(MAGIC) + FOOTER_BYTES or file.read() != MAGIC or path.suffix == PARTIAL:
        raise UserError(
            f"Expected a finished recording, but {path} breaks off before its end; run: station repair {path}"
        )


def _damaged(path: Path, what: str) -> UserError:
    return UserError(f"{path} is damaged: {what}; station repair {path} saves what can still be read")


def class_of(topic: str, schema: str) -> type[Message] | None:
    """The class of a topic's messages; None if the schema is unknown, not that of this topic, or for viewers alone."""
    if topic in FOR_VIEWERS:
        return None
    found = _CLASSES.get(schema)
    return None if topics.known(topic) and topics.topic(topic).message is not found else found


class RecordingReader:
    """A finished recording. It holds no file open between calls, and no more than the overlapping chunks within one."""

    def __init__(self, path: Path, summary: Summary) -> None:
        assert summary.statistics is not None
        self.path = path
        self.summary = summary
        self.missing = ""
        """A sentence on what should have come after it and is not there."""
        self.seams: tuple[str, ...] = ()
        """Sentences on what does not fit together where parts meet."""
        self._malformed: dict[str, set[int]] = {}
        self.first_place = 0
        """The size of the parts before this one: a message's place in the whole recording is its own and this."""
        counts = summary.statistics.channel_message_counts
        self._infos: dict[int, TopicInfo] = {}
        for number, channel in summary.channels.items():
            schema = summary.schemas[channel.schema_id].name if channel.schema_id in summary.schemas else ""
            name = channel.topic.removeprefix("/")
            self._infos[number] = TopicInfo(name, schema, class_of(name, schema), counts.get(number, 0))
        self.start_ns: int = summary.statistics.message_start_time
        """The first log time."""
        self.end_ns: int = summary.statistics.message_end_time
        """The last log time."""

    @property
    def topics(self) -> dict[str, TopicInfo]:
        """Every topic of the file, `truth/` too, by name."""
        return {info.name: info for info in sorted(self._infos.values(), key=lambda info: info.name)}

    @property
    def message_count(self) -> int:
        """The number of messages in the file, of all topics."""
        return sum(info.count for info in self._infos.values())

    @property
    def metadata_names(self) -> frozenset[str]:
        """The names of the metadata records, without reading them."""
        return frozenset(index.name for index in self.summary.metadata_indexes)

    @property
    def unpacked_bytes(self) -> int:
        """The size of all its messages when they are unpacked, as the index says."""
        return sum(index.uncompressed_size for index in self.summary.chunk_indexes)

    @property
    def compressions(self) -> tuple[str, ...]:
        """The names of the chunks' compressions that occur."""
        return tuple(sorted({index.compression for index in self.summary.chunk_indexes}))

    @property
    def duration_s(self) -> float:
        """The time from the first to the last log time, s."""
        return (self.end_ns - self.start_ns) * 1e-9

    def messages(
        self,
        topics: Collection[str] | None = None,
        from_ns: int | None = None,
        to_ns: int | None = None,
        *,
        truth: bool = False,
    ) -> Iterator[Recorded]:
        """Messages by log time (equal ones as they were written), with from_ns ≤ log time < to_ns.

        Topics whose schema this version does not know are left out; `topics` tells of them. So are payloads that are
        no message of their topic; `malformed` tells how many.

        Raises:
            UserError: if the file turns out to be damaged, or for a topic of the truth without `truth`.
        """
        wanted = self._wanted(topics, truth=truth)
        for raw in self._raw(wanted, from_ns, to_ns):
            info = wanted[raw.channel_id]
            assert info.message is not None
            message = message_of(info.message, raw)
            if message is None:
                self.leave_out(info.name, [raw.place])
                continue
            yield Recorded(
                info.name, payload=raw.payload, message=message, publish_ns=raw.publish_ns, log_ns=raw.log_ns
            )

    def leave_out(self, topic: str, places: Iterable[int]) -> None:
        """Takes note, by their places, of payloads that are no message of their topic; the first of each is told."""
        known = self._malformed.setdefault(topic, set())
        before = len(known)
        known.update(self.first_place + place for place in places)
        if known and not before:
            _LOG.warning("%s: /%s holds payloads that are no messages of it; they are left out", self.path, topic)

    @property
    def malformed(self) -> dict[str, int]:
        """Payloads by topic that are no message of it, as far as the file was read: they are left out."""
        return {topic: len(found) for topic, found in self._malformed.items() if found}

    def count_as_part_of(self, whole: RecordingReader, first_place: int) -> None:
        """Takes note of what is left out in the recording of which this is a part, behind what parts before it hold."""
        self._malformed, self.first_place = whole._malformed, first_place

    @cached_property
    def _first_places(self) -> dict[int, int]:
        """The size of the chunks before a chunk, by the place of the chunk in the file."""
        indexes = sorted(self.summary.chunk_indexes, key=lambda index: index.chunk_start_offset)
        sizes = accumulate((index.uncompressed_size for index in indexes), initial=0)
        return {index.chunk_start_offset: before for index, before in zip(indexes, sizes, strict=False)}

    def _wanted(self, topics: Collection[str] | None, *, truth: bool) -> dict[int, TopicInfo]:
        names = None if topics is None else {topic.removeprefix("/") for topic in topics}
        if names is not None and not truth and any(name.startswith(TRUTH) for name in names):
            raise UserError(
                "The simulation's truth is not for measuring: ask for it with truth=True, in tests and views"
            )
        return {
            number: info
            for number, info in self._infos.items()
            if info.message is not None
            and (truth or not info.name.startswith(TRUTH))
            and (names is None or info.name in names)
        }

    def batches(
        self, topics: Collection[str], from_ns: int | None = None, to_ns: int | None = None
    ) -> Iterator[tuple[dict[int, TopicInfo], Batch]]:
        """Yields the messages many at a time, in the order of the file, with what the channels' numbers mean.

        Raises:
            UserError: as `messages` does, but for payloads, which are not looked at.
        """
        wanted = self._wanted(topics, truth=False)
        low, high = self._span(from_ns, to_ns)
        with self.path.open("rb") as file:
            together, size = list[tuple[ChunkIndex, Unpacked]](), 0
            chunks = self._chunks(wanted, low, high)
            for number, index in enumerate(chunks, start=1):
                together.append((index, self._unpacked(file, index)))
                size += len(together[-1][1].records)
                if size >= _TOGETHER_BYTES or number == len(chunks):
                    for batch in self._batched(together, wanted):
                        yield wanted, self._timely(batch, wanted, low, high)
                    together, size = [], 0

    def _timely(self, batch: Batch, wanted: dict[int, TopicInfo], low: int, high: int) -> Batch:
        """The messages of these times; those with stamps that no message has are left out."""
        stamped = (batch.log_ns >= 0) & (batch.publish_ns >= 0)
        for number in np.unique(batch.channel[~stamped]).tolist():
            self.leave_out(wanted[number].name, batch.place[~stamped & (batch.channel == number)].tolist())
        return batch.select(stamped & (batch.log_ns >= low) & (batch.log_ns < high))

    def _batched(self, together: list[tuple[ChunkIndex, Unpacked]], wanted: dict[int, TopicInfo]) -> Iterator[Batch]:
        at_once = batch_of([chunk for _, chunk in together], wanted=wanted)
        if at_once is not None:
            yield at_once
            return
        for index, chunk in together:
            try:
                yield batch_by_walking(chunk, wanted=wanted)
            except BROKEN as error:
                raise self._damage_at(index, error) from error

    def _span(self, from_ns: int | None, to_ns: int | None) -> tuple[int, int]:
        return from_ns or 0, to_ns if to_ns is not None else self.end_ns + 1

    def _chunks(self, wanted: dict[int, TopicInfo], low: int, high: int) -> list[ChunkIndex]:
        """The chunks with messages of these channels and times, by the time of their first message."""
        return [
            index
            for index in sorted(self.summary.chunk_indexes, key=lambda index: index.message_start_time)
            if index.message_end_time >= low
            and index.message_start_time < high
            and (not index.message_index_offsets or not wanted.keys().isdisjoint(index.message_index_offsets))
        ]

    def _raw(self, wanted: dict[int, TopicInfo], from_ns: int | None, to_ns: int | None) -> Iterator[RawMessage]:
        low, high = self._span(from_ns, to_ns)
        chunks = self._chunks(wanted, low, high)
        waiting: list[RawMessage] = []
        with self.path.open("rb") as file:
            for number, index in enumerate(chunks):
                if sum(len(raw.payload) + HELD_BYTES for raw in waiting) > MAX_HELD_BYTES:
                    raise _damaged(self.path, "so many of its chunks overlap in time that they cannot be held at once")
                waiting += [raw for raw in self._chunk(file, index, wanted) if low <= raw.log_ns < high]
                # Stable, so that equal times keep the order of the file; and linear, as they are nearly sorted.
                waiting.sort(key=_log_ns)
                if number + 1 < len(chunks) and waiting:
                    ready = _count_before(waiting, chunks[number + 1].message_start_time)
                    yield from waiting[:ready]
                    del waiting[:ready]
            yield from waiting

    def _chunk(self, file: BinaryIO, index: ChunkIndex, wanted: Collection[int]) -> list[RawMessage]:
        records = self._records(file, index)
        try:
            return messages(records, wanted=wanted, first_place=self._first_places[index.chunk_start_offset])
        except BROKEN as error:
            raise self._damage_at(index, error) from error

    def _unpacked(self, file: BinaryIO, index: ChunkIndex) -> Unpacked:
        records, behind = self._records(file, index), index.chunk_start_offset + index.chunk_length
        try:
            indexes = read_at(file, behind, index.message_index_length)
        except BROKEN as error:
            raise self._damage_at(index, error) from error
        return Unpacked(records, indexes, self._first_places[index.chunk_start_offset])

    def _records(self, file: BinaryIO, index: ChunkIndex) -> bytes:
        try:
            content = io.BytesIO(read_at(file, index.chunk_start_offset, index.chunk_length)[9:])
            return unpack(Chunk.read(ReadDataStream(content)))
        except BROKEN as error:
            raise self._damage_at(index, error) from error

    def _damage_at(self, index: ChunkIndex, error: BaseException) -> UserError:
        return _damaged(self.path, f"{error} (at byte {index.chunk_start_offset})")

    @cached_property
    def metadata(self) -> dict[str, dict[str, str]]:
        """The metadata records by name, without their checksums; of several with one name the last."""
        return self._described.records

    @cached_property
    def changed_metadata(self) -> tuple[str, ...]:
        """The metadata records that are not as they were written."""
        return self._described.changed

    @cached_property
    def _described(self) -> Described:
        with self.path.open("rb") as file:
            return described([self._record_at(file, index) for index in self.summary.metadata_indexes])

    def _record_at(self, file: BinaryIO, index: MetadataIndex) -> Found:
        try:
            return record_at(file, index)
        except BROKEN as error:
            raise _damaged(self.path, f"metadata '{index.name}' ({error})") from error

    @cached_property
    def attachments(self) -> dict[str, bytes]:
        """The attached files by name."""
        with self.path.open("rb") as file:
            found: dict[str, bytes] = {}
            for index in self.summary.attachment_indexes:
                try:
                    record = attachment_of(read_at(file, index.offset, index.length)[9:])
                except BROKEN as error:
                    raise _damaged(self.path, f"attachment '{index.name}' ({error})") from error
                found[record.name] = record.data
            return found

    def samples(self) -> tuple[Sample, ...]:
        """The session's samples in the order in which they were taken."""
        found = list[tuple[int, int, Sample]]()
        for channels, batch in self.batches({"session/sample"}):
            if len(found) + len(batch.log_ns) > MOST_SAMPLES:
                raise _damaged(self.path, f"expected at most {MOST_SAMPLES} samples, it holds more")
            numbers = [number for number, info in channels.items() if info.message is Sample]
            found += self.decoded("session/sample", batch.select(np.isin(batch.channel, numbers)), Sample)
        return tuple(sample for *_, sample in sorted(found, key=itemgetter(0)))

    def decoded(self, topic: str, batch: Batch, cls: type[M]) -> list[tuple[int, int, M]]:
        """Log time, publish time (ns) and message of a batch of one topic; what is no message of it is left out."""
        found = list[tuple[int, int, M]]()
        for number, (log_ns, publish_ns) in enumerate(
            zip(batch.log_ns.tolist(), batch.publish_ns.tolist(), strict=True)
        ):
            try:
                found.append((log_ns, publish_ns, wire.decode(cls, batch.payloads.bytes(number))))
            except UserError:
                self.leave_out(topic, [int(batch.place[number])])
        return found


def message_of(cls: type[M], raw: RawMessage) -> M | None:
    """The message as it stands in the file; None if it is none of this class, or has a time that no message has."""
    if max(raw.log_ns, raw.publish_ns) > LATEST_NS:
        return None
    try:
        return wire.decode(cls, raw.payload)
    except UserError:
        return None


def attachment_of(content: bytes) -> Attachment:
    """The attachment in a record's content; its CRC, which the library skips, is checked.

    Raises:
        DamageError: if it is wrong.
    """
    (crc,) = struct.unpack("<I", content[-4:])
    if crc and zlib.crc32(content[:-4]) != crc:
        raise DamageError("its checksum (CRC) is wrong")
    return Attachment.read(ReadDataStream(io.BytesIO(content)))


def _log_ns(raw: RawMessage) -> int:
    return raw.log_ns


def _count_before(sorted_messages: list[RawMessage], time_ns: int) -> int:
    return bisect_left(sorted_messages, time_ns, key=_log_ns)


def digest(reader: RecordingReader) -> str:
    """SHA-256 of every measured message: topic, capture time and bytes, in order.

    Two sessions of one seed in simulated time have the same. Metadata (versions, file names) and the truth are not in
    it; nor are log times, which in a live session are never twice the same.
    """
    total = hashlib.sha256()
    for item in reader.messages():
        total.update(f"{item.topic} {item.publish_ns} {len(item.payload)}\n".encode())
        total.update(item.payload)
    return total.hexdigest()
