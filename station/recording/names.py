"""Gives finished files of a recording their names; what somebody else has named so meanwhile stays."""

from __future__ import annotations

import contextlib
import logging
import os
from pathlib import Path

from shared.system.files import name_anew
from station.recording.parts import later_files

_LOG = logging.getLogger(__name__)
_State = tuple[int, int, int, int]


class Names:
    """The names of one recording's files; whoever gives them has claimed them (`station.recording.claim`).

    The recording may replace what lies under its name as it begins, and no other file.
    """

    def __init__(self, first: Path) -> None:
        """Takes note of the recording at `first` and of its parts, which the new one replaces."""
        states = {path: _state(path) for path in (first, *later_files(first))}
        self._old = {path: state for path, state in states.items() if state is not None}

    def begun(self, unfinished: Path) -> None:
        """Takes note that a file is the new recording's own."""
        self._old.pop(unfinished, None)

    def give(self, unfinished: Path, path: Path) -> Path:
        """Names a finished file `path`, or with a number after it if somebody else has that name; returns the name.

        With the first file's name the recording that it replaces is gone, and not before.

        Raises:
            OSError: if it cannot be named.
        """
        if _state(path) == self._old.pop(path, ()):
            os.replace(unfinished, path)
            found = path
        else:
            found = give_free_name(unfinished, path)
        if found == path:
            self._remove_old()
        self._old.clear()
        return found

    def _remove_old(self) -> None:
        """Takes the old recording's later parts away."""
        for path, state in self._old.items():
            if _state(path) == state:
                with contextlib.suppress(OSError):  # somebody reads it, on Windows: it stays, and no reader takes it in
                    path.unlink()


def _state(path: Path) -> _State | None:
    """Returns what tells a file from a later one of its name; None if there is none."""
    try:
        found = path.stat()
    except FileNotFoundError:
        return None
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns


def give_free_name(unfinished: Path, path: Path) -> Path:
    """Names a finished file `path`, or with a number after it if somebody else has that name; returns the name.

    Raises:
        OSError: if it cannot be named.
    """
    found, number = path, 1
    while not _named(unfinished, found):
        number += 1
        found = path.with_name(f"{path.stem}-{number}{path.suffix}")
    if found != path:
        _LOG.warning("%s has become another file's name meanwhile: what was recorded is in %s", path, found)
    return found


def _named(unfinished: Path, path: Path) -> bool:
    try:
        name_anew(unfinished, path)
    except FileExistsError:
        return False
    return True
