"""A file that can still be closed properly when the disk is full."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
from pathlib import Path

from shared.errors import UserError
from shared.system.files import lock, locked, occupy

RESERVE_BYTES = 4 * 1024 * 1024
"""Room kept back: one chunk (1 MiB), its index and the summary of a long session fit into it."""

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT)


def reserve_path(path: Path) -> Path:
    """Returns the place of the room kept back for `path`: a hidden file beside it, gone when the file is closed."""
    return path.with_name(f".{path.name}.reserve")


def free_bytes(folder: Path) -> int:
    """Returns the room that is left on the disk of a folder."""
    return shutil.disk_usage(folder).free


def being_written(path: Path) -> bool:
    """Returns true if a process is writing this file now."""
    with path.open("rb", buffering=0) as file:
        return locked(file)


class ReservedFile:
    """An unbuffered binary file for appending, with a reserve that is given up when the disk runs full.

    `full` turns true at that moment; the write that met the full disk succeeds, and so does closing the recording.
    What was written is with the operating system when `write` returns: a killed process loses none of it.
    """

    def __init__(self, path: Path, *, reserve_bytes: int = RESERVE_BYTES) -> None:
        """Creates the file, and its folder if only that is missing. What it held is gone once nothing can fail.

        Raises:
            UserError: if somebody writes the file, or the folder cannot be written to or has no room for the reserve.
        """
        self.full = False
        self._position = 0
        self._path, self._reserve = path, reserve_path(path)
        try:
            path.parent.mkdir(exist_ok=True)
            self._file = path.open("ab", buffering=0)
        except OSError as error:
            raise _unwritable(path, reserve_bytes, error) from error
        try:
            # The lock tells a repair that somebody is still writing; it ends with the process, however that ends.
            lock(self._file)
        except OSError as error:
            self._file.close()  # it is another's, and so is its reserve
            raise _unwritable(path, reserve_bytes, error) from error
        try:
            self._keep_back(reserve_bytes)
            self._file.truncate(0)
        except OSError as error:
            held = os.fstat(self._file.fileno()).st_size > 0
            self.close() if held else self.discard()
            raise _unwritable(path, reserve_bytes, error) from error

    def _keep_back(self, size: int) -> None:
        with self._reserve.open("wb", buffering=0) as file:
            occupy(file, size)

    def _drop_reserve(self) -> bool:
        try:
            self._reserve.unlink()
        except OSError:
            return False
        return True

    def write(self, data: bytes) -> int:
        """Appends all of `data`; raises OSError only when even the reserve was not enough."""
        rest = memoryview(data)
        while rest:
            try:
                written = self._file.write(rest)
            except OSError as error:
                self.full = self.full or error.errno in _NO_ROOM
                if error.errno not in _NO_ROOM or not self._drop_reserve():
                    raise
                continue
            self._position += written
            rest = rest[written:]
        return len(data)

    def tell(self) -> int:
        """Returns the bytes written so far."""
        return self._position

    def flush(self) -> None:
        """Does nothing: nothing waits here."""

    def sync(self) -> None:
        """Waits until the bytes are on the disk itself."""
        with contextlib.suppress(OSError):  # some file systems cannot; the bytes are with the kernel in any case
            os.fsync(self._file.fileno())

    def let_go(self) -> None:
        """Closes the file here alone: another process, born from this one, goes on with it."""
        self._file.close()

    def close(self) -> None:
        """Closes the file and gives the reserve back."""
        self._file.close()
        self._drop_reserve()

    def discard(self) -> None:
        """Closes the file and takes it away."""
        self.close()
        self._path.unlink(missing_ok=True)


def _unwritable(path: Path, reserve_bytes: int, error: OSError) -> UserError:
    return UserError(
        f"Expected a folder with at least {reserve_bytes / 1e6:.0f} MB of room to record into, but {path} cannot be "
        f"written ({error.strerror}); choose another folder or free some space"
    )
