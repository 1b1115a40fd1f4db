"""A memory of the newest motions."""

from __future__ import annotations

from typing import Generic, TypeVar

Key = TypeVar("Key")
Value = TypeVar("Value")

MOST_MOTIONS = 400
"""The number of motions that are remembered: 50 steps and their returns in four directions (4 MB planned, 2 MB judged).

A session that has narrowed its range asks for new angles in every run, so that older motions are of no more use.
"""


class Remembered(Generic[Key, Value]):
    """Results by key; the oldest is forgotten where there are more than MOST_MOTIONS."""

    def __init__(self) -> None:
        self._known: dict[Key, Value] = {}

    def __len__(self) -> int:
        return len(self._known)

    def get(self, key: Key) -> Value | None:
        """Returns the result for the key; None if there is none, or none any more."""
        return self._known.get(key)

    def put(self, key: Key, value: Value) -> None:
        """Remembers what was found."""
        self._known[key] = value
        if len(self._known) > MOST_MOTIONS:
            del self._known[next(iter(self._known))]

    def clear(self) -> None:
        """Forgets everything."""
        self._known.clear()
