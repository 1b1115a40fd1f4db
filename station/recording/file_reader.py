"""Reads one finished recording in bounded memory: a few chunks at a time, every checksum checked.

`/truth/**`, which simulated sessions may hold, is handed out only when asked for by name: nothing that measures,
analyses or diagnoses may see it.
"""

from __future__ import annotations

import logging
from collections.abc import Collection, Iterable, Iterator
from functools import cached_property
from operator import itemgetter
from pathlib import Path

import numpy as np
from mcap.summary import Summary

from shared import wire
from shared.errors import UserError
from shared.messages import Sample
from shared.visible import visible
from station.recording.batches import Batch
from station.recording.counts import METADATA as COUNTS
from station.recording.counts import miscounted
from station.recording.described import Described, attachments_at, metadata_at
from station.recording.in_batches import in_batches
from station.recording.in_order import in_order
from station.recording.indexed import damaged
from station.recording.malformed import LeftOut
from station.recording.recorded import TRUTH, M, Recorded, TopicInfo, message_of
from station.recording.recording_info import RecordingInfo

_LOG = logging.getLogger(__name__)
MOST_SAMPLES = 200_000
"""Ten times the longest session, of 20 000 runs; as objects they take 250 MB, which a file of some kB may ask for."""


class RecordingReader(RecordingInfo):
    """A finished recording. It holds no file open between calls, and no more than the overlapping chunks within one."""

    def __init__(self, path: Path, summary: Summary) -> None:
        super().__init__(path, summary)
        self._left_out = LeftOut()
        self.first_offset = 0
        """The size of the parts before this one: a message's offset in the whole recording is its own and this."""

    def messages(
        self,
        topics: Collection[str] | None = None,
        from_ns: int | None = None,
        to_ns: int | None = None,
        *,
        truth: bool = False,
    ) -> Iterator[Recorded]:
        """Yields messages by log time (equal ones as they were written), with from_ns ≤ log time < to_ns.

        Topics whose schema this version does not know are left out; `topics` tells of them. So are payloads that are
        no message of their topic; `malformed` tells how many.

        Raises:
            UserError: if the file turns out to be damaged, or for a topic of the truth without `truth`.
        """
        wanted = self._wanted(topics, truth=truth)
        for raw in in_order(self._chunks, wanted, *self._span(from_ns, to_ns)):
            info = wanted[raw.channel_id]
            assert info.message is not None
            message = message_of(info.message, raw)
            if message is None:
                self.leave_out(info.name, [raw.offset])
                continue
            yield Recorded(
                info.name, payload=raw.payload, message=message, publish_ns=raw.publish_ns, log_ns=raw.log_ns
            )

    @property
    def measured_count(self) -> int:
        """The number of messages that `messages` yields without being asked for the truth, malformed ones included."""
        return sum(info.count for info in self._wanted(None, truth=False).values())

    def leave_out(self, topic: str, offsets: Iterable[int]) -> None:
        """Takes note, by their offsets, of payloads that are no message of their topic; the first of each is told."""
        if self._left_out.add(topic, [self.first_offset + offset for offset in offsets]):
            warning = "%s: /%s holds payloads that are no messages of it; they are left out"
            _LOG.warning(warning, self.path, visible(topic))

    @property
    def malformed(self) -> dict[str, int]:
        """Payloads by topic that are no message of it, as far as the file was read: they are left out."""
        return self._left_out.counts

    def count_as_part_of(self, whole: RecordingReader, first_offset: int) -> None:
        """Takes note of what is left out in the recording of which this is a part, behind what parts before it hold."""
        self._left_out, self.first_offset = whole._left_out, first_offset

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
        for batch in in_batches(self._chunks, wanted, low, high):
            yield wanted, self._timely(batch, wanted, low, high)

    def _timely(self, batch: Batch, wanted: dict[int, TopicInfo], low: int, high: int) -> Batch:
        """Returns the messages of these times; those with stamps that no message has are left out."""
        stamped = (batch.log_ns >= 0) & (batch.publish_ns >= 0)
        for number in np.unique(batch.channel[~stamped]).tolist():
            self.leave_out(wanted[number].name, batch.offset[~stamped & (batch.channel == number)].tolist())
        return batch.select(stamped & (batch.log_ns >= low) & (batch.log_ns < high))

    def _span(self, from_ns: int | None, to_ns: int | None) -> tuple[int, int]:
        return from_ns or 0, to_ns if to_ns is not None else self.end_ns + 1

    @cached_property
    def metadata(self) -> dict[str, dict[str, str]]:
        """The metadata records by name, without their checksums; of several with one name the last."""
        return self._described.records

    @property
    def mode(self) -> str:
        """The mode of the session, live or lockstep; empty where nothing says so."""
        return self.metadata.get("session", {}).get("mode", "")

    @cached_property
    def changed_metadata(self) -> tuple[str, ...]:
        """The metadata records that are not as they were written."""
        return self._described.changed

    @cached_property
    def miscounted(self) -> tuple[str, ...]:
        """Sentences on topics of which it holds another number of messages than were written."""
        return tuple(
            miscounted(self.metadata.get(COUNTS, {}), {name: info.count for name, info in self.topics.items()})
        )

    @cached_property
    def _described(self) -> Described:
        return metadata_at(self.path, self.summary.metadata_indexes)

    @cached_property
    def attachments(self) -> dict[str, bytes]:
        """The attached files by name."""
        return attachments_at(self.path, self.summary.attachment_indexes)

    def samples(self) -> tuple[Sample, ...]:
        """Returns the session's samples in the order in which they were taken."""
        found = list[tuple[int, int, Sample]]()
        for channels, batch in self.batches({"session/sample"}):
            if len(found) + len(batch.log_ns) > MOST_SAMPLES:
                raise damaged(self.path, f"expected at most {MOST_SAMPLES} samples, it holds more")
            numbers = [number for number, info in channels.items() if info.message is Sample]
            found += self.decoded("session/sample", batch.select(np.isin(batch.channel, numbers)), Sample)
        return tuple(sample for *_, sample in sorted(found, key=itemgetter(0)))

    def decoded(self, topic: str, batch: Batch, cls: type[M]) -> list[tuple[int, int, M]]:
        """Returns the log time, publish time (ns) and message of a batch of one topic.

        What is no message of it is left out.
        """
        found = list[tuple[int, int, M]]()
        for number, (log_ns, publish_ns) in enumerate(
            zip(batch.log_ns.tolist(), batch.publish_ns.tolist(), strict=True)
        ):
            try:
                found.append((log_ns, publish_ns, wire.decode(cls, batch.payloads.bytes(number))))
            except UserError:
                self.leave_out(topic, [int(batch.offset[number])])
        return found
