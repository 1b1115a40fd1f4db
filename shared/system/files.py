"""Files: a lock that says that somebody writes, room on the disk that is really there, and writing for power cuts."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import sys
from pathlib import Path

if sys.platform == "win32":
    import msvcrt

    _LOCKED_BYTE = 2**31 - 2
    """Windows locks bytes, and nobody else can read them then. This one lies behind whatever a repair has to read while
    somebody writes, and is the last that `msvcrt.locking` reaches, whose positions have 32 bits."""

    def lock(file: io.FileIO) -> None:
        """Marks a new file as being written until it is closed, or its process ends, however that ends.

        Raises:
            OSError: if somebody else has marked it.
        """
        _at_locked_byte(file, msvcrt.LK_NBLCK)

    def locked(file: io.FileIO) -> bool:
        """Returns true if another open file has the mark."""
        try:
            _at_locked_byte(file, msvcrt.LK_NBLCK)
        except OSError:
            return True
        _at_locked_byte(file, msvcrt.LK_UNLCK)
        return False

    def remove_locked(file: io.FileIO, path: Path) -> None:
        """Closes a file that is locked here and takes it away, unless somebody has opened it meanwhile."""
        file.close()  # an open file cannot be taken away
        with contextlib.suppress(OSError):
            path.unlink()

    def name_anew(path: Path, name: Path) -> None:
        """Gives a closed file a name that nobody has.

        Raises:
            FileExistsError: if somebody has it.
            OSError: if it cannot be named.
        """
        path.rename(name)

    def _at_locked_byte(file: io.FileIO, mode: int) -> None:
        before = file.tell()
        file.seek(_LOCKED_BYTE)
        try:
            msvcrt.locking(file.fileno(), mode, 1)
        finally:
            file.seek(before)

else:
    import fcntl

    def lock(file: io.FileIO) -> None:
        """Marks a new file as being written until it is closed, or its process ends, however that ends.

        Raises:
            OSError: if somebody else has marked it.
        """
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def locked(file: io.FileIO) -> bool:
        """Returns true if another open file has the mark."""
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        return False

    def remove_locked(file: io.FileIO, path: Path) -> None:
        """Takes a file away that is locked here, and closes it."""
        with contextlib.suppress(OSError):
            path.unlink()  # before it is closed: whoever locks it next would lose the file
        file.close()

    def name_anew(path: Path, name: Path) -> None:
        """Gives a closed file a name that nobody has.

        Raises:
            FileExistsError: if somebody has it.
            OSError: if it cannot be named.
        """
        try:
            os.link(path, name)
        except (FileExistsError, FileNotFoundError):
            raise
        except OSError:  # a disk without links (FAT): the name is taken first, and given to the file then
            name.open("xb").close()
            os.replace(path, name)
        else:
            path.unlink()


if sys.platform == "linux":

    def occupy(file: io.FileIO, size_bytes: int) -> None:
        """Takes room on the disk for an empty file.

        Raises:
            OSError: if there is not so much room.
        """
        os.posix_fallocate(file.fileno(), 0, size_bytes)

else:

    def occupy(file: io.FileIO, size_bytes: int) -> None:
        """Takes room on the disk for an empty file: only what is written and on the disk is surely there.

        Raises:
            OSError: if there is not so much room.
        """
        rest = memoryview(bytes(size_bytes))
        while rest:
            rest = rest[file.write(rest) :]
        os.fsync(file.fileno())


def write_through(path: Path, text: str) -> None:
    """Writes a small file, with the folders that it lacks, so that a power cut forgets neither the text nor the name.

    Raises:
        OSError: if it cannot be written.
    """
    named_anew = [path.parent]
    while not named_anew[-1].exists():
        named_anew.append(named_anew[-1].parent)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", errors="replace") as file:
        file.write(text)
        file.flush()
        _sync(file.fileno())
    for folder in named_anew:
        _sync_folder(folder)


def _sync_folder(folder: Path) -> None:
    if sys.platform == "win32":  # opens no folder; its file systems keep a journal of names
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        _sync(descriptor)
    finally:
        os.close(descriptor)


def _sync(descriptor: int) -> None:
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno != errno.EINVAL:  # a file system that cannot wait for its disk, as some of the network
            raise


def open_to_others(path: Path) -> bool:
    """Returns true if others than its owner may read or write a file.

    Windows says so by other means, which are not asked.
    """
    return sys.platform != "win32" and bool(path.stat().st_mode & 0o077)


def writable_by_others(path: Path) -> bool:
    """Returns true if others than its owner may write to a file, or put files into a folder and take them away.

    Windows says so by other means, which are not asked.
    """
    return sys.platform != "win32" and bool(path.stat().st_mode & 0o022)
