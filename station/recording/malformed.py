"""Counts payloads that are no message of their topic: every reader leaves them out, and says how many they were."""

from __future__ import annotations

from collections.abc import Iterable, Mapping


class LeftOut:
    """The offsets of such payloads by topic: however often one is read, it is counted once."""

    def __init__(self) -> None:
        self._found: dict[str, set[int]] = {}

    def add(self, topic: str, offsets: Iterable[int]) -> bool:
        """Takes note of them; True for the first ones of their topic."""
        known = self._found.setdefault(topic, set())
        before = len(known)
        known.update(offsets)
        return bool(known) and not before

    @property
    def counts(self) -> dict[str, int]:
        """The numbers of them by topic."""
        return {topic: len(found) for topic, found in self._found.items() if found}


def counted(malformed: Mapping[str, int]) -> str:
    """Returns the numbers of such payloads by topic, as in '3 on /session/sample, 1 on /clock'."""
    return ", ".join(f"{count} on /{topic}" for topic, count in sorted(malformed.items()))


def left_out(malformed: Mapping[str, int]) -> str:
    """Returns a sentence on what was left out; empty if nothing was."""
    if not malformed:
        return ""
    return f"Left out: {counted(malformed)}, which are no messages of their topic, or have times that no message has."
