"""The recordings of a folder, and what was made of each: its report, its diagnosis, its view."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from shared.errors import UserError
from station.app.recordings import FOLDER
from station.recording.opening import open_file
from station.recording.parts import files_of, firsts

REPORT, DIAGNOSIS = "report", "diagnosis"


@dataclass(frozen=True)
class Shelf:
    """The recordings in a folder and in its `recordings`; `name` is a path from the folder, with slashes."""

    folder: Path

    @property
    def new_ones(self) -> Path:
        """The folder in which sessions are recorded."""
        return self.folder / FOLDER

    def listed(self) -> list[dict[str, Any]]:
        """Returns the name, size, times and made pages of each recording, the last written first.

        `started_s` is the recording's own start, s since 1970, or None where it cannot be read; `mode` says what made
        it.
        """
        found = [path for folder in (self.folder, self.new_ones) for path in folder.glob("*.mcap")]
        known = [(path, path.stat()) for path in map(Path, firsts(map(str, found))) if path.is_file()]
        return [
            {
                "name": self._name(path),
                "bytes": sum(part.stat().st_size for part in files_of(path)),
                "changed_s": stat.st_mtime,
                **_own_time(path, stat.st_mtime_ns, stat.st_size),
                "pages": [kind for kind in (REPORT, DIAGNOSIS) if self.page(path, kind).is_file()],
            }
            for path, stat in sorted(known, key=lambda one: (-one[1].st_mtime, one[0].name))
        ]

    def path(self, name: str) -> Path:
        """Returns the recording of that name.

        Raises:
            UserError: if the list has none of that name.
        """
        for one in self.listed():
            if one["name"] == name:
                return self.folder / name
        raise UserError(f"Expected a recording in {self.folder}, found none called '{name}'; load the list again")

    def page(self, recording: Path, kind: str) -> Path:
        """Returns the path of the page of that kind that is made from a recording."""
        stem = recording.with_suffix("")
        return (
            (stem.with_name(f"{stem.name}-report") / "report.html") if kind == REPORT else Path(f"{stem}-{kind}.html")
        )

    def _name(self, path: Path) -> str:
        return path.relative_to(self.folder).as_posix()


@lru_cache(maxsize=10_000)
def _own_time(path: Path, _changed_ns: int, _bytes: int) -> dict[str, Any]:
    """Returns the start and the mode of a recording, read again only when its file has changed."""
    try:
        recording = open_file(path)
        mode = recording.mode
    except UserError:  # its other pages say what is wrong with it
        return {"started_s": None, "mode": ""}
    return {"started_s": 1e-9 * recording.start_ns if recording.message_count else None, "mode": mode}
