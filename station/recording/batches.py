"""The messages of chunks as offsets in their bytes, for those who read many of them at once.

The message indexes that follow a chunk say where its messages begin. They have no checksum of their own, so they are
believed only if the records that they point at follow each other without a gap from the first to the last byte; else
the records are read one after another, as `station.recording.chunks` does.

A live recording has hundreds of small chunks: several are taken together.
"""

from __future__ import annotations

import struct
from collections.abc import Container, Sequence
from typing import Any, NamedTuple

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from station.recording.chunks import HEAD, messages
from station.recording.unpacking import PADDING, Integers, Payloads

_INDEX = struct.Struct("<BQHI")
_HEADER = np.dtype(
    [("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("seq", "<u4"), ("log_ns", "<i8"), ("publish_ns", "<i8")]
)
_PREFIX = 9
"""Bytes of a record before its content: opcode and length."""


class Batch(NamedTuple):
    """Messages in the order of the file: channel, times (n,), where their payloads are, and their writer's numbers.

    `sequence` (n,) is the number that the writer gave each among those of its topic; other writers may give none.
    `offset` (n,) is where the content of each begins in all that was unpacked: no other message has the same. Times
    of 2^63 ns and later, which no clock has, are negative.
    """

    channel: Integers
    log_ns: Integers
    publish_ns: Integers
    payloads: Payloads
    offset: Integers
    sequence: Integers

    def select(self, chosen: NDArray[Any]) -> Batch:
        """Returns the messages that are chosen (n,)."""
        payloads = self.payloads.select(chosen)
        columns = (self.channel, self.log_ns, self.publish_ns, self.offset, self.sequence)
        channel, log_ns, publish_ns, offset, sequence = (column[chosen] for column in columns)
        return Batch(channel, log_ns, publish_ns, payloads, offset, sequence)


class Unpacked(NamedTuple):
    """A chunk's records, the message indexes that follow it in the file, and how much the chunks before it hold."""

    records: bytes
    indexes: bytes
    first_offset: int


def batch_of(chunks: Sequence[Unpacked], *, wanted: Container[int]) -> Batch | None:
    """Returns the messages of the wanted channels in successive chunks; None if the indexes are missing or wrong."""
    begins, offsets, size = list[Integers](), list[Integers](), 0
    for chunk in chunks:
        begin = _begins(chunk.indexes)
        if begin is None:
            return None
        begins.append(np.sort(begin) + size)
        offsets.append(begins[-1] - size + chunk.first_offset + _PREFIX)
        size += len(chunk.records)
    # The records of chunks one after another are such records again.
    records = b"".join([*(chunk.records for chunk in chunks), bytes(PADDING)])
    begin, offset = (np.concatenate([np.empty(0, np.int64), *each]) for each in (begins, offsets))
    if len(begin) and not 0 <= begin.min() <= begin.max() <= size - _HEADER.itemsize:
        return None
    data = np.frombuffer(records, dtype=np.uint8)
    header: Any = np.ndarray((len(data) - _HEADER.itemsize,), _HEADER, buffer=data, strides=(1,))[begin]
    if not _tiles(records, size, begin, header):
        return None
    channel, log_ns, publish_ns, length, sequence = (
        header[name].astype(np.int64) for name in ("channel", "log_ns", "publish_ns", "length", "seq")
    )
    payloads = Payloads(data, begin + _HEADER.itemsize, begin + _PREFIX + length)
    found = Batch(channel, log_ns, publish_ns, payloads, offset, sequence)
    known = [number for number in np.unique(channel).tolist() if number in wanted]
    return found.select(np.isin(channel, known))


def batch_by_walking(chunk: Unpacked, *, wanted: Container[int]) -> Batch:
    """Returns the same of one chunk, record by record.

    Raises:
        DamageError: if they do not fit together.
    """
    found = messages(chunk.records, wanted=wanted, first_offset=chunk.first_offset)
    data = np.frombuffer(b"".join([*(raw.payload for raw in found), bytes(PADDING)]), dtype=np.uint8)
    end = np.cumsum([len(raw.payload) for raw in found], dtype=np.int64)
    begin = np.concatenate([np.zeros(1, np.int64), end])[:-1]
    columns = ((raw.channel_id, raw.log_ns, raw.publish_ns, raw.offset, raw.sequence) for raw in found)
    rows = np.array(list(columns), dtype=np.uint64).reshape(-1, 5)
    channel, log_ns, publish_ns, offset, sequence = rows.T.astype(np.int64)
    return Batch(channel, log_ns, publish_ns, Payloads(data, begin, end), offset, sequence)


def _begins(indexes: bytes) -> Integers | None:
    """Returns the offsets of a chunk's messages; None if the indexes cannot be right."""
    found, position = list[NDArray[np.int64]](), 0
    while position < len(indexes):
        if position + _INDEX.size > len(indexes):
            return None
        opcode, length, _, entries = _INDEX.unpack_from(indexes, position)
        inside = position + _INDEX.size
        if opcode != Opcode.MESSAGE_INDEX or entries % 16 or length < entries + 6 or inside + entries > len(indexes):
            return None
        found.append(np.frombuffer(indexes, "<i8", entries // 8, inside)[1::2])
        position += _PREFIX + length
    return np.concatenate(found) if found else None


def _tiles(records: bytes, size: int, begin: Integers, header: Any) -> bool:
    """Returns true if the messages, with other records between them, fill the first `size` bytes without a gap."""
    length = header["length"]
    if not np.all((header["opcode"] == Opcode.MESSAGE) & (length >= _HEADER.itemsize - _PREFIX) & (length <= size)):
        return False
    ends = np.concatenate([[0], begin + _PREFIX + length.astype(np.int64)])
    begins = np.concatenate([begin, [size]])
    gaps = np.flatnonzero(ends != begins)
    return all(_others(records, int(ends[gap]), int(begins[gap])) for gap in gaps.tolist())


def _others(records: bytes, position: int, end: int) -> bool:
    """Returns true if a stretch is records other than messages."""
    while position + HEAD.size <= end:
        opcode, length = HEAD.unpack_from(records, position)
        if opcode == Opcode.MESSAGE:
            return False
        position += HEAD.size + length
    return position == end
