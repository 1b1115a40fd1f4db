"""Hands out the messages of a file many at a time, in the order of the file: for those who read whole columns."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from mcap.records import ChunkIndex

from station.recording.batches import Batch, Unpacked, batch_by_walking, batch_of
from station.recording.bounded import BROKEN
from station.recording.indexed import IndexedChunks

_TOGETHER_BYTES = 1 << 20
"""Chunks smaller than this are read together."""


def in_batches(chunks: IndexedChunks, channels: Collection[int], low: int, high: int) -> Iterator[Batch]:
    """Yields the messages of these channels in the chunks of these times; some of their messages may have other times.

    Raises:
        UserError: if a chunk is damaged.
    """
    together, size = list[tuple[ChunkIndex, Unpacked]](), 0
    indexes = chunks.within(channels, low, high)
    with chunks.path.open("rb") as file:
        for number, index in enumerate(indexes, start=1):
            together.append((index, chunks.unpacked(file, index)))
            size += len(together[-1][1].records)
            if size >= _TOGETHER_BYTES or number == len(indexes):
                yield from _batched(chunks, together, channels)
                together, size = [], 0


def _batched(
    chunks: IndexedChunks, together: Sequence[tuple[ChunkIndex, Unpacked]], channels: Collection[int]
) -> Iterator[Batch]:
    at_once = batch_of([chunk for _, chunk in together], wanted=channels)
    if at_once is not None:
        yield at_once
        return
    for index, chunk in together:
        try:
            yield batch_by_walking(chunk, wanted=channels)
        except BROKEN as error:
            raise chunks.damage_at(index, error) from error
