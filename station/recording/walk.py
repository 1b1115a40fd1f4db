"""Walks the records of a file from its beginning as far as they go, by the index where there is one."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO

from mcap.opcode import Opcode

from station.recording.bounded import read_at
from station.recording.chunks import HEAD, MAX_CHUNK_BYTES, DamageError
from station.recording.index import FOOTER_BYTES
from station.recording.index_entries import IndexEntries, IndexEntry
from station.recording.mcap_file import MAGIC

_DATA_END_BYTES = 4
"""The length of the record that ends the data: its CRC alone."""
_MESSAGE_INDEX = struct.Struct("<HI")
_OF_INDEX = {
    Opcode.CHUNK_INDEX,
    Opcode.ATTACHMENT_INDEX,
    Opcode.METADATA_INDEX,
    Opcode.STATISTICS,
    Opcode.SUMMARY_OFFSET,
}


@dataclass(frozen=True, slots=True)
class Record:
    """A record: its offset in the file, its kind, its content, and its name in the index (None: it is not in there)."""

    offset: int
    opcode: int
    content: bytes
    name: str | None = None


@dataclass(frozen=True, slots=True)
class Gap:
    """Bytes in which no record can be told; `last` if none follows that could be found."""

    length: int
    last: bool


def walk(file: BinaryIO, entries: IndexEntries) -> Iterator[Record | Gap]:
    """Yields every record of the data, and every gap between them, in the order of the file.

    A file that does not say where its data ends is cut off: it ends with a gap, though it may be of no bytes.
    Behind a chunk stand the indexes of its messages: one of them that calls itself a message would add one that
    nobody sent, and is a gap.
    """
    size, position, in_chunk = file.seek(0, 2), len(MAGIC), False
    while position < size:
        found, end = _next(file, position, entries, size)
        if isinstance(found, Record):
            if _is_end(found, behind=size - end):
                return
            if in_chunk and found.opcode == Opcode.MESSAGE and _is_message_index(found.content):
                found = Gap(end - position, last=False)
        yield found
        position, in_chunk = end, isinstance(found, Gap) or found.opcode in (Opcode.CHUNK, Opcode.MESSAGE_INDEX)
    yield Gap(0, last=True)


def _is_end(record: Record, *, behind: int) -> bool:
    """Returns true for the end of the data, and for the footer, before which that end was not recognized."""
    if record.opcode == Opcode.FOOTER:
        return HEAD.size + len(record.content) == FOOTER_BYTES and behind == len(MAGIC)
    return record.opcode == Opcode.DATA_END and len(record.content) == _DATA_END_BYTES


def _next(file: BinaryIO, position: int, entries: IndexEntries, size: int) -> tuple[Record | Gap, int]:
    """Returns the record or gap that begins there, and the offset of the next.

    Some writers give a length of 0 in their index: a length that cannot be is taken from the record's head.
    """
    known, stop = entries.at(position), entries.next_after(position)
    if known is not None and HEAD.size <= known.length <= min(stop - position, MAX_CHUNK_BYTES):
        return _named(file, known), position + known.length
    head = read_at(file, position, HEAD.size)
    opcode, length = HEAD.unpack(head) if len(head) == HEAD.size else (0, size)
    end = position + HEAD.size + length
    named_otherwise = known is not None and known.opcode != opcode
    blank = not opcode and not length  # as a power cut leaves a file's end: one gap, not millions of records
    if named_otherwise or blank or end > stop or length > MAX_CHUNK_BYTES:
        return Gap(stop - position, last=stop == size), stop
    return Record(position, opcode, read_at(file, position + HEAD.size, length)), end


def _named(file: BinaryIO, known: IndexEntry) -> Record:
    content = read_at(file, known.offset + HEAD.size, known.length - HEAD.size)
    return Record(known.offset, known.opcode, content, known.name)


def holds_nothing(record: Record, *, indexed: bool) -> bool:
    """Returns true for a record that a repair makes anew: the header, the indexes, and what an index consists of.

    Where the file has an index, that index names everything else. Where it has none, a record of an index has nothing
    to do among the data: its kind is damaged.

    Raises:
        DamageError: if it is called an index of messages and is none.
    """
    if record.opcode == Opcode.MESSAGE_INDEX:
        if record.name is None and not _is_message_index(record.content):
            raise DamageError("an index of messages does not have the length that it says")
        return True
    return record.offset == len(MAGIC) if record.opcode == Opcode.HEADER else indexed and record.opcode in _OF_INDEX


def _is_message_index(content: bytes) -> bool:
    """Returns true for an index of messages: a channel, a size in bytes, and so many bytes of times and offsets."""
    if len(content) < _MESSAGE_INDEX.size:
        return False
    _, size = _MESSAGE_INDEX.unpack_from(content)
    return size % 16 == 0 and len(content) == _MESSAGE_INDEX.size + size
