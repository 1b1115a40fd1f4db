"""The origin of a published recording: what it says of itself, and the sums by which it is recognised."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from shared.errors import UserError
from shared.messages import Sample
from station.recording.parts import sha256_of
from station.recording.provenance import whole_number
from station.recording.reader import TRUTH, RecordingReader, digest, open_recording
from station.recording.summary import is_kept

_DIGITS = 8
"""Hexadecimal digits of the file's sum in a session's name, as simulated sessions all start at one time."""


@dataclass(frozen=True, kw_only=True)
class Source:
    """A recording that is published: `name` is its file's name in the dataset, `started` an ISO 8601 time (UTC).

    `sha256` is the sum of the file, `digest` that of its measured messages, which a repaired copy has as well.
    """

    reader: RecordingReader
    name: str
    sha256: str
    digest: str
    rig: str
    session: str
    seed: int | None
    mode: str
    started: str
    versions: dict[str, str]
    samples: tuple[Sample, ...]

    @property
    def kept(self) -> int:
        """The samples that count: those that slipped, without a flag."""
        return sum(map(is_kept, self.samples))

    @property
    def simulated(self) -> bool:
        """True if no hardware was there."""
        return any(name.startswith(TRUTH) for name in self.reader.topics)

    def as_json(self) -> dict[str, Any]:
        """Returns its line of provenance.json."""
        fields = ("sha256", "digest", "rig", "session", "seed", "mode", "started", "versions")
        counts = {"samples": len(self.samples), "kept": self.kept}
        return {"file": f"recordings/{self.name}", **{key: getattr(self, key) for key in fields}, **counts}


def sources_of(paths: list[Path]) -> tuple[Source, ...]:
    """Returns the recordings in their order; those of one name are numbered.

    Raises:
        UserError: if a file is missing, damaged, no recording, or there twice.
    """
    found = list[Source]()
    for path in paths:
        if path.suffix != ".mcap":
            raise UserError(f"Expected recordings (.mcap) to publish, got '{path.name}'")
        one = _source(path, taken={other.name for other in found})
        twice = next((other for other in found if other.digest == one.digest), None)
        if twice is not None:
            raise UserError(
                f"Expected every recording once, but {path} holds the messages of {twice.reader.path}; name only one"
            )
        found.append(one)
    return tuple(found)


def _source(path: Path, *, taken: set[str]) -> Source:
    reader = open_recording(path)
    session = reader.metadata.get("session", {})
    started = datetime.fromtimestamp((whole_number(session.get("started_ns", "")) or reader.start_ns) // 10**9, UTC)
    content = sha256_of(path)
    return Source(
        reader=reader,
        name=_free_name(path, taken),
        sha256=content,
        digest=digest(reader),
        rig=session.get("rig_id", ""),
        session=f"{started:%Y%m%dT%H%M%SZ}-{content[:_DIGITS]}",
        seed=whole_number(session.get("seed", "")),
        mode=session.get("mode", ""),
        started=started.isoformat(),
        versions=reader.metadata.get("versions", {}),
        samples=reader.samples(),
    )


def _free_name(path: Path, taken: set[str]) -> str:
    name, number = path.name, 2
    while name in taken:
        name, number = f"{path.stem}-{number}{path.suffix}", number + 1
    return name
