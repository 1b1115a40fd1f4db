"""The facts that the index of a recording tells, without reading a message."""

from __future__ import annotations

from pathlib import Path

from mcap.summary import Summary

from station.recording.indexed import IndexedChunks
from station.recording.recorded import TopicInfo, topics_of


class RecordingInfo:
    """The facts on one finished recording; no file is held open."""

    def __init__(self, path: Path, summary: Summary) -> None:
        assert summary.statistics is not None
        self.path = path
        self.summary = summary
        self.missing = ""
        """A sentence on what should have come after it and is not there."""
        self.seams: tuple[str, ...] = ()
        """Sentences on what does not fit together where parts meet."""
        self._chunks = IndexedChunks(path, summary)
        self._infos = topics_of(summary)
        self.start_ns: int = summary.statistics.message_start_time
        """The first log time."""
        self.end_ns: int = summary.statistics.message_end_time
        """The last log time."""

    @property
    def parts_missing(self) -> tuple[str, ...]:
        """Sentences on parts of a recording in several files that are not there, or hold something else."""
        return (*self.seams, *filter(None, [self.missing]))

    @property
    def topics(self) -> dict[str, TopicInfo]:
        """Every topic of the file, `truth/` too, by name."""
        return {info.name: info for info in sorted(self._infos.values(), key=lambda info: info.name)}

    @property
    def message_count(self) -> int:
        """The number of messages in the file, of all topics."""
        return sum(info.count for info in self._infos.values())

    @property
    def metadata_names(self) -> frozenset[str]:
        """The names of the metadata records, without reading them."""
        return frozenset(index.name for index in self.summary.metadata_indexes)

    @property
    def unpacked_bytes(self) -> int:
        """The size of all its messages when they are unpacked, as the index says."""
        return self._chunks.unpacked_bytes

    @property
    def compressions(self) -> tuple[str, ...]:
        """The names of the chunks' compressions that occur."""
        return self._chunks.compressions

    @property
    def duration_s(self) -> float:
        """The time from the first to the last log time, s."""
        return (self.end_ns - self.start_ns) * 1e-9
