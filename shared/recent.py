"""Tells what was there before among the last few: a camera that shows one picture again, or a ring of them in turn.

A stalled driver hands its buffers out again in turn: each picture differs from the one before it, and is that
of some pictures ago.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable

BUFFERS = 64
"""The pictures among which one is sought again: twice as many as V4L2 lets a driver have (VIDEO_MAX_FRAME is 32)."""


class Recent:
    """Remembers the last BUFFERS things, by their hashes."""

    def __init__(self) -> None:
        self._last: deque[int] = deque(maxlen=BUFFERS)

    def has(self, thing: Hashable) -> bool:
        """Takes one, and returns true if it was among the last ones."""
        key = hash(thing)
        again = key in self._last
        self._last.append(key)
        return again
