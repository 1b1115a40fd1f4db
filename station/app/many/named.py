"""The recordings that a command line names: files, globs and folders, on this machine or elsewhere.

A folder means the recordings (.mcap) at any depth, with those that broke off; tables in it are mostly made of them, and
would count twice. A glob means every recording and table that it matches. A file that has the name of a glob is itself.
The later parts of a recording are read with its first one, and are none of their own beside it.
"""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from shared.errors import UserError
from station.app.many import remote
from station.recording.parts import files_of, firsts

RECORDINGS = (".mcap", ".mcap.partial")
TABLES = (".csv", ".parquet")


@dataclass(frozen=True, kw_only=True)
class Chosen:
    """The recordings by name, in order; `one` is True if a single file was named as such."""

    names: tuple[str, ...]
    one: bool


def chosen(words: Sequence[str], *, tables: bool = True) -> Chosen:
    """Finds what the words name, before any work.

    Args:
        words: paths, globs, folders or addresses.
        tables: True if the command takes tables of samples as well.

    Raises:
        UserError: if a word names nothing.
    """
    if len(words) == 1 and _is_plain(words[0]):  # should it be missing, the command says so in words of its own
        return Chosen(names=tuple(words), one=True)
    kinds = (*RECORDINGS, *TABLES) if tables else RECORDINGS
    found: list[str] = []
    for word in words:
        if _is_file(word):
            found.append(word)
            continue
        more = _within(word, kinds)
        if not more:
            raise UserError(f"Expected {_said(tables)} at {word}, found none")
        found += [name for name in more if name not in found]
    found = firsts(found)
    return Chosen(names=tuple(found), one=len(found) == 1 and found[0] in words)


def size_bytes(names: Iterable[str]) -> int | None:
    """Returns the size of all, or None where one is elsewhere."""
    if any(remote.is_remote(name) for name in names):
        return None
    return sum(part.stat().st_size for name in names for part in files_of(Path(name)))


def _is_plain(word: str) -> bool:
    """Returns true for the name of a file on this machine that is there or missing: no glob, folder or address."""
    path = Path(word)
    return not remote.is_remote(word) and not path.is_dir() and (path.exists() or not glob.has_magic(word))


def _is_file(word: str) -> bool:
    """Returns true for a file; False for a folder and a glob.

    Raises:
        UserError: if there is nothing of that name.
    """
    if remote.is_remote(word):
        return remote.is_file(word)
    path = Path(word)
    if path.is_dir() or (glob.has_magic(word) and not path.exists()):
        return False
    if path.exists():
        return True
    raise UserError(f"Expected a recording at {path}, but it cannot be read: {os.strerror(2)}")


def _within(word: str, kinds: tuple[str, ...]) -> list[str]:
    if remote.is_remote(word):
        return remote.within(word, kinds=kinds, recordings=RECORDINGS)
    path = Path(word)
    if path.is_dir():
        return sorted(str(one) for one in path.rglob("*") if one.name.endswith(RECORDINGS) and one.is_file())
    matched = glob.glob(os.path.expanduser(word), recursive=True)
    return sorted(name for name in matched if name.endswith(kinds) and Path(name).is_file())


def _said(tables: bool) -> str:
    return "recordings (.mcap) or tables (.csv, .parquet)" if tables else "recordings (.mcap)"
