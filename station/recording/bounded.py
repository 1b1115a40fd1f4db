"""Bounds for what a file makes its reader take: a length in it may be damage, or be meant to exhaust the memory."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from typing import BinaryIO

from mcap.exceptions import McapError
from mcap.records import ChunkIndex

from station.recording.chunks import MAX_CHUNK_BYTES, DamageError

BROKEN = (
    McapError,
    DamageError,
    struct.error,
    ValueError,
    KeyError,
    IndexError,
    EOFError,
    MemoryError,
    OverflowError,
)
"""The errors of the library when the bytes are not what they should be (its EndOfFile is a McapError)."""
MOST_TIMES_LARGER = 100
"""The largest ratio of what a file holds to its size: our own reach 1.2 to 1.8, and bombs thousands."""
ALWAYS_UNPACKED_BYTES = 16 * 1024 * 1024
"""A file may hold as much whatever its size: the messages of it take some 400 MB as objects, the shortest ones too."""


def read_at(file: BinaryIO, offset: int, length: int, *, most: int = MAX_CHUNK_BYTES) -> bytes:
    """Reads `length` bytes from there on, as far as the file goes: the memory for a length is taken before it is read.

    Raises:
        DamageError: for more bytes than any record has.
    """
    there = min(length, max(0, file.seek(0, 2) - offset))
    if there > most:
        raise DamageError(f"a record claims to be {length / 1e9:.1f} GB long")
    if not there:
        return b""
    file.seek(offset)
    return file.read(there)


def most_unpacked(file_bytes: int) -> int:
    """Returns the size of what a file of this size may hold when it is unpacked."""
    return max(ALWAYS_UNPACKED_BYTES, MOST_TIMES_LARGER * file_bytes)


def require_unpacked_within(indexes: Iterable[ChunkIndex], *, file_bytes: int) -> None:
    """Refuses a small file that would be a large one.

    Raises:
        DamageError: if its chunks claim to hold far more than compressed measurements do.
    """
    held = sum(index.uncompressed_size for index in indexes)
    most = most_unpacked(file_bytes)
    if held > most:
        raise DamageError(
            f"expected at most {most / 1e6:.0f} MB packed in {file_bytes} bytes, it claims {held / 1e6:.0f} MB"
        )
