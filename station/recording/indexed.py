"""The chunks of a finished recording: found by its index, read one at a time, and every checksum checked."""

from __future__ import annotations

from collections.abc import Collection
from functools import cached_property
from itertools import accumulate
from pathlib import Path
from typing import BinaryIO

from mcap.records import ChunkIndex
from mcap.summary import Summary

from shared.errors import UserError
from station.recording.batches import Unpacked
from station.recording.bounded import BROKEN, read_at
from station.recording.chunks import HEAD, DamageError, RawMessage, chunk_of, messages, unpack
from station.recording.index_entries import IndexEntries, named


def damaged(path: Path, what: str) -> UserError:
    """Returns the sentence on a file that is not as it was written."""
    return UserError(f"{path} is damaged: {what}; station repair {path} saves what can still be read")


class IndexedChunks:
    """The chunks of one file."""

    def __init__(self, path: Path, summary: Summary) -> None:
        self.path = path
        self._summary = summary
        self._indexes = summary.chunk_indexes

    @property
    def unpacked_bytes(self) -> int:
        """The size of all of them when they are unpacked, as the index says."""
        return sum(index.uncompressed_size for index in self._indexes)

    @property
    def compressions(self) -> tuple[str, ...]:
        """The names of the compressions that occur."""
        return tuple(sorted({index.compression for index in self._indexes}))

    def within(self, channels: Collection[int], low: int, high: int) -> list[ChunkIndex]:
        """Gives the chunks with messages of these channels and with `low` ≤ log time < `high`, by their first time."""
        wanted = set(channels)
        return [
            index
            for index in sorted(self._indexes, key=lambda index: index.message_start_time)
            if index.message_end_time >= low
            and index.message_start_time < high
            and (not index.message_index_offsets or not wanted.isdisjoint(index.message_index_offsets))
        ]

    def messages(self, file: BinaryIO, index: ChunkIndex, wanted: Collection[int]) -> list[RawMessage]:
        """Returns the messages of a chunk.

        Raises:
            UserError: if it is damaged.
        """
        records = self._records(file, index)
        try:
            return messages(records, wanted=wanted, first_offset=self._first_offsets[index.chunk_start_offset])
        except BROKEN as error:
            raise self.damage_at(index, error) from error

    def unpacked(self, file: BinaryIO, index: ChunkIndex) -> Unpacked:
        """Returns a chunk's records, with the message indexes behind it.

        Raises:
            UserError: if it is damaged.
        """
        records, behind = self._records(file, index), index.chunk_start_offset + index.chunk_length
        room = self._entries.next_after(index.chunk_start_offset) - behind
        try:
            indexes = read_at(file, behind, min(index.message_index_length, room))
        except BROKEN as error:
            raise self.damage_at(index, error) from error
        return Unpacked(records, indexes, self._first_offsets[index.chunk_start_offset])

    def damage_at(self, index: ChunkIndex, error: BaseException) -> UserError:
        """Returns the sentence on a damaged chunk."""
        return damaged(self.path, f"{error} (at byte {index.chunk_start_offset})")

    def _records(self, file: BinaryIO, index: ChunkIndex) -> bytes:
        try:
            chunk = chunk_of(read_at(file, index.chunk_start_offset, index.chunk_length)[HEAD.size :])
            if chunk.uncompressed_size != index.uncompressed_size:
                raise DamageError("a chunk is not as large as the index says")
            return unpack(chunk)
        except BROKEN as error:
            raise self.damage_at(index, error) from error

    @cached_property
    def _entries(self) -> IndexEntries:
        return IndexEntries(named(self._summary), size=self.path.stat().st_size)

    @cached_property
    def _first_offsets(self) -> dict[int, int]:
        """The size of the chunks before a chunk, by the offset of the chunk in the file."""
        indexes = sorted(self._indexes, key=lambda index: index.chunk_start_offset)
        sizes = accumulate((index.uncompressed_size for index in indexes), initial=0)
        return {index.chunk_start_offset: before for index, before in zip(indexes, sizes, strict=False)}
