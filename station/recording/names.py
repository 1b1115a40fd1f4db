"""Gives finished files of a recording their names, and takes away the parts of the recording that it replaces."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from station.recording.parts import later_files


class Names:
    """The names of one recording's files; whoever gives them has claimed them (`station.recording.claim`)."""

    def __init__(self, first: Path) -> None:
        self._old_parts = set(later_files(first))

    def begun(self, unfinished: Path) -> None:
        """Takes note that a file is the new recording's own."""
        self._old_parts.discard(unfinished)

    def give(self, unfinished: Path, path: Path) -> None:
        """Names a finished file; with the first one the recording that it replaces is gone, and not before.

        Raises:
            OSError: if it cannot be named.
        """
        os.replace(unfinished, path)
        while self._old_parts:
            with contextlib.suppress(OSError):  # somebody reads it: it stays, and is no part of this recording
                self._old_parts.pop().unlink(missing_ok=True)
