"""The offsets, kinds and names of a finished recording's records, as its index has them.

The index has a checksum; the nine bytes at the head of a record, which say its kind and length, have none. What the
index names is therefore found and read by it, and a record that it does not name may not run over one that it does.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain

from mcap.opcode import Opcode
from mcap.summary import Summary


@dataclass(frozen=True, slots=True)
class IndexEntry:
    """A record as the index has it: `offset` and `length` in bytes with its head, and its kind."""

    offset: int
    length: int
    opcode: int
    name: str = ""


class IndexEntries:
    """The entries of one file, which is `size` bytes long."""

    def __init__(self, entries: Iterable[IndexEntry], *, size: int) -> None:
        self._by_offset = {entry.offset: entry for entry in entries}
        self._offsets = sorted(self._by_offset)
        self._size = size

    def at(self, offset: int) -> IndexEntry | None:
        """Returns the record that begins there, if the index names one."""
        return self._by_offset.get(offset)

    def next_after(self, offset: int) -> int:
        """Returns the offset at which the next record of the index begins; the size of the file after the last."""
        number = bisect_right(self._offsets, offset)
        return self._offsets[number] if number < len(self._offsets) else self._size


def index_entries_of(summary: Summary | None, *, size: int) -> IndexEntries:
    """Returns the entries of an index; none without an index."""
    return IndexEntries([] if summary is None else chain(_message_indexes(summary), named(summary)), size=size)


def named(summary: Summary) -> list[IndexEntry]:
    """Returns the chunks, attachments and metadata records that an index names, in the order of the file."""
    return sorted(chain(_chunks(summary), _described(summary)), key=lambda entry: entry.offset)


def _message_indexes(summary: Summary) -> Iterable[IndexEntry]:
    """Yields the message indexes of each chunk, which stand behind it, one a channel, taken for one record."""
    for index in summary.chunk_indexes:
        if index.message_index_length:
            behind = index.chunk_start_offset + index.chunk_length
            yield IndexEntry(behind, index.message_index_length, Opcode.MESSAGE_INDEX)


def _chunks(summary: Summary) -> Iterable[IndexEntry]:
    for index in summary.chunk_indexes:
        yield IndexEntry(index.chunk_start_offset, index.chunk_length, Opcode.CHUNK)


def _described(summary: Summary) -> Iterable[IndexEntry]:
    for index in summary.attachment_indexes:
        yield IndexEntry(index.offset, index.length, Opcode.ATTACHMENT, index.name)
    for index in summary.metadata_indexes:
        yield IndexEntry(index.offset, index.length, Opcode.METADATA, index.name)
