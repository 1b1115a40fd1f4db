"""Reads a recording's parts as one: every message once, in order of receipt across the seams."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import accumulate, pairwise
from operator import attrgetter

from shared.errors import UserError
from station.recording.batches import Batch
from station.recording.chunks import HELD_BYTES
from station.recording.file_reader import RecordingReader
from station.recording.in_order import MAX_HELD_BYTES
from station.recording.parts import BEFORE, CONTINUED, METADATA, NUMBER
from station.recording.recorded import Recorded, TopicInfo


class PartedReader(RecordingReader):
    """Several parts of one session; it holds no more of them in memory than the messages that overlap at a seam."""

    def __init__(self, parts: Sequence[RecordingReader], *, missing: str = "") -> None:
        """`missing` says what should have come after the last part, or nothing.

        Raises:
            UserError: if a file is no part of this session, or another one than its name says.
        """
        super().__init__(parts[0].path, parts[0].summary)
        self.missing = missing
        self._parts = tuple(parts)
        for number, part in enumerate(parts, start=1):
            _require_same_session(parts[0], part, number)
        for part, first_offset in zip(
            parts, accumulate((part.unpacked_bytes for part in parts), initial=0), strict=False
        ):
            part.count_as_part_of(self, first_offset)
        self.seams = tuple(_seams(parts))
        held = [part for part in parts if part.message_count] or [parts[0]]
        self.start_ns = min(part.start_ns for part in held)
        self.end_ns = max(part.end_ns for part in held)

    @property
    def topics(self) -> dict[str, TopicInfo]:
        """Every topic of any part, by name."""
        found = dict[str, TopicInfo]()
        for part in self._parts:
            for name, info in part.topics.items():
                before = found.get(name)
                found[name] = info if before is None else replace(before, count=before.count + info.count)
        return dict(sorted(found.items()))

    @property
    def message_count(self) -> int:
        """The number of messages in all parts."""
        return sum(part.message_count for part in self._parts)

    @property
    def compressions(self) -> tuple[str, ...]:
        """The names of the compressions that occur."""
        return tuple(sorted({name for part in self._parts for name in part.compressions}))

    def messages(
        self,
        topics: Collection[str] | None = None,
        from_ns: int | None = None,
        to_ns: int | None = None,
        *,
        truth: bool = False,
    ) -> Iterator[Recorded]:
        """Yields the messages as of one file, all in order.

        A part may hold what came just before the end of the one before.

        Raises:
            UserError: as of one file; or if the parts overlap in time by more than fits into memory.
        """
        parts = self._within(from_ns, to_ns)
        waiting = list[Recorded]()
        for number, part in enumerate(parts):
            items = heapq.merge(waiting, part.messages(topics, from_ns, to_ns, truth=truth), key=attrgetter("log_ns"))
            next_ns = min((later.start_ns for later in parts[number + 1 :]), default=None)
            waiting = list[Recorded]()
            held = 0
            for item in items:
                if next_ns is None or item.log_ns < next_ns:
                    yield item
                    continue
                waiting.append(item)
                held += len(item.payload) + HELD_BYTES
                if held > MAX_HELD_BYTES:
                    raise UserError(f"Expected the parts of {self.path} one after another, but they overlap in time")

    def batches(
        self, topics: Collection[str], from_ns: int | None = None, to_ns: int | None = None
    ) -> Iterator[tuple[dict[int, TopicInfo], Batch]]:
        """Yields the batches as of one file, part after part; a topic's number is another one in each."""
        for part in self._within(from_ns, to_ns):
            for channels, batch in part.batches(topics, from_ns, to_ns):
                yield channels, batch._replace(offset=batch.offset + part.first_offset)

    def _within(self, from_ns: int | None, to_ns: int | None) -> list[RecordingReader]:
        """Returns the parts with messages of these times; one at least, which refuses what must not be asked for."""
        low, high = self._span(from_ns, to_ns)
        held = (part for part in self._parts if part.message_count)
        return [part for part in held if part.end_ns >= low and part.start_ns < high] or [self._parts[0]]

    @cached_property
    def metadata(self) -> dict[str, dict[str, str]]:
        """The metadata records of all parts by name; of several with one name the last."""
        return {name: record for part in self._parts for name, record in part.metadata.items()}

    @cached_property
    def changed_metadata(self) -> tuple[str, ...]:
        """The metadata records that are not as they were written, in any part."""
        return tuple(dict.fromkeys(name for part in self._parts for name in part.changed_metadata))

    @cached_property
    def miscounted(self) -> tuple[str, ...]:
        """Sentences on topics of which a part holds another number of messages than were written into it."""
        return tuple(f"{part.path.name}: {sentence}" for part in self._parts for sentence in part.miscounted)

    @cached_property
    def attachments(self) -> dict[str, bytes]:
        """The attached files of all parts by name; of several with one name the first, with which the session began."""
        return {name: data for part in reversed(self._parts) for name, data in part.attachments.items()}


def part_metadata(part: RecordingReader) -> dict[str, str]:
    """Returns the metadata by which a file tells that it is a part; nothing where the recording is one file."""
    return part.metadata.get(METADATA, {}) if METADATA in part.metadata_names else {}


def is_first(reader: RecordingReader) -> bool:
    """Returns true for a whole recording, or one that begins with its first part; false for a later part alone."""
    return part_metadata(reader).get(NUMBER, "1") == "1" or isinstance(reader, PartedReader)


def _require_same_session(first: RecordingReader, part: RecordingReader, number: int) -> None:
    same = part.metadata.get("session") == first.metadata.get("session")
    if not same or part_metadata(part).get(NUMBER) != str(number):
        raise UserError(
            f"Expected {part.path} to be part {number} of the session that begins in {first.path}, but it is not; move "
            "it away, or put the right file there"
        )


def _seams(parts: Sequence[RecordingReader]) -> Iterator[str]:
    """Yields a sentence for each seam at which the parts hold another number of messages than when written."""
    held = 0
    for before, part in pairwise(parts):
        held += before.message_count
        said = part_metadata(part).get(BEFORE, "")
        if said != str(held):
            yield f"expected {said or 'a number of'} messages before {part.path.name}, found {held}"


def continued_in(part: RecordingReader) -> str:
    """Returns the name that the next part had when it was written; empty for the last one."""
    return part_metadata(part).get(CONTINUED, "")
