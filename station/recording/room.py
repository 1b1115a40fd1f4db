"""The room that a file's size allows for what it unpacks to, taken chunk by chunk, where there is no index to ask."""

from __future__ import annotations

from mcap.records import Chunk

from station.recording.bounded import most_unpacked
from station.recording.chunks import DamageError, unpack


class BombError(DamageError):
    """A chunk would make far more of its file than compressed measurements do."""


class Room:
    """The size that may still be unpacked of a file of so many bytes."""

    def __init__(self, file_bytes: int) -> None:
        self._left = most_unpacked(file_bytes)

    def unpacked(self, chunk: Chunk) -> bytes:
        """Returns the records of a chunk.

        Raises:
            BombError: if it claims more than is left.
            DamageError: if it cannot be unpacked, or its CRC is wrong.
        """
        if chunk.uncompressed_size > self._left:
            raise BombError("a chunk claims to hold more than its file has room for")
        records = unpack(chunk)
        self._left -= len(records)
        return records
