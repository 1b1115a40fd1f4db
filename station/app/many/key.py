"""The version of a result: a digest of what computes it, the program with its libraries and what it was asked."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import shared
import station
from station.app.versions import versions
from station.recording.parts import sha256_of

_SOURCES = (".py", ".toml", ".xml")
"""The endings of the files that compute: code, arms and scenes."""


def key_of(command: str, asked: Mapping[str, Any]) -> str:
    """Returns the version of a command's results, in 64 digits.

    Args:
        command: its name.
        asked: the options on which its results depend. Of a file that one names (`rig.toml`, `my_sim.py:function`) the
            content counts as well, and of a folder the files in it.
    """
    said = {name: _said(value) for name, value in sorted(asked.items())}
    everything = [command, versions(), sources_digest(), said]
    return hashlib.sha256(json.dumps(everything, sort_keys=True).encode()).hexdigest()


def digest_of(path: Path) -> str:
    """Returns the SHA-256 of a file's content, of a recording in parts that of all of them.

    Raises:
        OSError: if it cannot be read.
    """
    return sha256_of(path)


@cache
def sources_digest() -> str:
    """Returns the SHA-256 of this program's files, by their places in it."""
    roots = [Path(str(package.__file__)).parent for package in (shared, station)]
    return _digest_of_all((root, path) for root in roots for path in _files(root))


def _said(value: Any) -> Any:
    if isinstance(value, list | tuple):
        return [_said(one) for one in value]  # pyright: ignore[reportUnknownVariableType]
    if isinstance(value, Path) and value.is_dir():
        return _digest_of_all((value, path) for path in _files(value))
    if isinstance(value, str | Path):
        file = Path(str(value).rpartition(":")[0] or value)
        return [str(value), *(digest_of(one) for one in {file, Path(value)} if one.suffix and one.is_file())]
    return getattr(value, "__qualname__", value)


def _files(root: Path) -> Iterator[Path]:
    yield from sorted(path for path in root.rglob("*") if path.suffix in _SOURCES and path.is_file())


def _digest_of_all(files: Iterable[tuple[Path, Path]]) -> str:
    found = hashlib.sha256()
    for root, path in files:
        found.update(f"{root.name}/{path.relative_to(root).as_posix()}\n{digest_of(path)}\n".encode())
    return found.hexdigest()
