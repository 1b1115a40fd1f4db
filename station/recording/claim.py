"""Claims the name of a recording for whoever writes it, so that two never write to one name.

The claim is a lock on a hidden file beside the recording. It holds for all of a session's files, from before the first
is opened until the last has its name, and it ends with the process, however that ends.
"""

from __future__ import annotations

import contextlib
import io
import os
from pathlib import Path

from shared.errors import UserError
from shared.system.files import lock, remove_locked
from station.recording.parts import first_name

_HELD = (BlockingIOError, PermissionError)
"""The errors by which a lock says that somebody else has it: the second one is that of Windows."""


def claim_path(path: Path) -> Path:
    """Returns the file whose lock claims the name of a recording, of which `path` may be any part."""
    return path.with_name(f".{first_name(path.name)}.claim")


class Claim:
    """The sole right to write files of a recording's name; a context manager that gives it back."""

    def __init__(self, path: Path) -> None:
        """Claims the name of the recording at `path`, and makes its folder if only that is missing.

        Raises:
            UserError: if somebody else has it, or the folder cannot be written to.
        """
        self._path, self._name = claim_path(path), path.with_name(first_name(path.name))
        try:
            path.parent.mkdir(exist_ok=True)
            while not self._holds():
                pass  # whoever had it took the file away between opening and locking it
        except OSError as error:
            raise UserError(
                f"Expected a folder to record into, but {path} cannot be written ({error.strerror}); choose another "
                "folder"
            ) from error

    def _holds(self) -> bool:
        """Returns true if the lock is held, and on the file that others will find.

        Raises:
            UserError: if somebody else has it.
        """
        self._file = self._path.open("ab", buffering=0)
        held = False
        try:
            self._lock()
            held = _is_at(self._path, self._file)
        finally:
            if not held:
                self._file.close()
        return held

    def _lock(self) -> None:
        try:
            lock(self._file)
        except _HELD as error:
            raise UserError(
                f"Expected a recording that nobody else writes, but another program is still writing {self._name} or a "
                "part of it; wait until it has ended, or choose another name"
            ) from error

    def __enter__(self) -> Claim:
        """Returns itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Gives the claim back."""
        self.release()

    def release(self) -> None:
        """Gives the claim back; doing so twice is harmless."""
        if not self._file.closed:
            remove_locked(self._file, self._path)

    def let_go(self) -> None:
        """Leaves the claim to another process, born from this one."""
        self._file.close()


def _is_at(path: Path, file: io.FileIO) -> bool:
    """Returns true if the open file is the one that has this name."""
    with contextlib.suppress(FileNotFoundError):
        return os.path.samestat(os.fstat(file.fileno()), path.stat())
    return False
