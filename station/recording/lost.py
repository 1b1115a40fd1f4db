"""Tells what a recording lacks, or has too much of: by its parts, its record of counts, and its messages' numbers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from station.recording.numbered import Numbered
from station.recording.reader import RecordingReader


@dataclass(frozen=True, slots=True)
class Lost:
    """Sentences on parts that are missing, and on topics by the record of counts and by their messages' numbers."""

    parts: tuple[str, ...] = ()
    miscounted: tuple[str, ...] = ()
    misnumbered: tuple[str, ...] = ()

    def by_rule(self) -> Iterator[tuple[str, str]]:
        """Yields the name of a broken rule and its sentence, for each."""
        for sentence in self.parts:
            yield "parts", sentence
        for sentence in self.miscounted:
            yield "count", f"{sentence}: they were counted when it was written"
        for sentence in self.misnumbered:
            yield "number", f"expected every message that was written, {sentence}"


def lost(reader: RecordingReader, numbers: Numbered) -> Lost:
    """Returns what a recording lacks; `numbers` are those of its messages."""
    return Lost(reader.parts_missing, reader.miscounted, tuple(numbers.sentences()))
