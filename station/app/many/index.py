"""The index of an output folder: a line of JSON for each recording, which says in which file its result is."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from station.app.many.each import Kept, Row

INDEX = "_recordings.jsonl"
"""Readers of datasets pass over names that begin like this."""


def write_index(kept: Kept, rows: Sequence[Row]) -> None:
    """Writes the rows into the index; recordings of earlier calls stay in it."""
    path = kept.folder / INDEX
    lines = read_index(path) | {row.recording: _line(row, kept) for row in rows}
    growing = path.with_name(f"{path.name}.partial")
    growing.write_text("".join(f"{json.dumps(line)}\n" for line in lines.values()), encoding="utf-8")
    os.replace(growing, path)


def read_index(path: Path) -> dict[str, dict[str, Any]]:
    """Reads the lines by the recordings' names; none where there is no index."""
    if not path.exists():
        return {}
    lines = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    return {line["recording"]: line for line in lines}


def _line(row: Row, kept: Kept) -> dict[str, Any]:
    return {
        "recording": row.recording,
        "status": row.status,
        "sha256": row.digest,
        "version": kept.key,
        "file": row.file,
        "reason": row.reason,
    }
