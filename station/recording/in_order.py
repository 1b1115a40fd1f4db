"""Hands out the messages of a file by log time: a chunk may hold what came before the end of the one before."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Collection, Iterator

from station.recording.chunks import HELD_BYTES, RawMessage
from station.recording.indexed import IndexedChunks, damaged

MAX_HELD_BYTES = 256 * 1024 * 1024
"""The size of messages that wait until no later chunk can hold an earlier one: one chunk of our own recordings."""


def in_order(chunks: IndexedChunks, channels: Collection[int], low: int, high: int) -> Iterator[RawMessage]:
    """Yields the messages of these channels with `low` ≤ log time < `high`; of equal times as they were written.

    Raises:
        UserError: if a chunk is damaged, or more of them overlap in time than can be held.
    """
    indexes = chunks.within(channels, low, high)
    waiting: list[RawMessage] = []
    with chunks.path.open("rb") as file:
        for number, index in enumerate(indexes):
            if sum(len(raw.payload) + HELD_BYTES for raw in waiting) > MAX_HELD_BYTES:
                raise damaged(chunks.path, "so many of its chunks overlap in time that they cannot be held at once")
            waiting += [raw for raw in chunks.messages(file, index, channels) if low <= raw.log_ns < high]
            # Stable, so that equal times keep the order of the file; and linear, as they are nearly sorted.
            waiting.sort(key=_log_ns)
            if number + 1 < len(indexes) and waiting:
                ready = bisect_left(waiting, indexes[number + 1].message_start_time, key=_log_ns)
                yield from waiting[:ready]
                del waiting[:ready]
        yield from waiting


def _log_ns(raw: RawMessage) -> int:
    return raw.log_ns
