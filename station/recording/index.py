"""Reads the index (summary) at the end of a recording: checked as a whole, before anything in it is believed.

The library would not check the CRC, would read from wherever a damaged footer says, and would unpack the chunks that it
meets there, of whatever size.
"""

from __future__ import annotations

import io
import struct
import zlib
from typing import BinaryIO

from mcap.records import AttachmentIndex, Channel, ChunkIndex, MetadataIndex, Schema, Statistics
from mcap.stream_reader import StreamReader
from mcap.summary import Summary

from station.recording.bounded import read_at
from station.recording.chunks import HEAD, DamageError
from station.recording.mcap_file import MAGIC

FOOTER_BYTES = HEAD.size + 20
MAX_INDEX_BYTES = 64 * 1024 * 1024
"""The largest index: a day of chunks of one second with twenty topics each has 25 MB. As objects it takes ten times."""
_BLOCK_BYTES = 1 << 20


def read_index(file: BinaryIO) -> Summary | None:
    """Reads the index of a finished recording; None if it has none.

    Raises:
        DamageError: if it is not as it was written, or lies where none can be.
        errors in `BROKEN`: if it is none.
    """
    end = file.seek(0, 2) - len(MAGIC)
    start, _, crc = struct.unpack_from("<QQI", read_at(file, end - FOOTER_BYTES, FOOTER_BYTES), HEAD.size)
    if not start:
        return None
    if start > end - FOOTER_BYTES or (crc and _checksum(file, start, end - 4) != crc):
        raise DamageError("the checksum (CRC) of its index is wrong")
    return _summary(read_at(file, start, end + len(MAGIC) - start, most=MAX_INDEX_BYTES))


def has_checksum(file: BinaryIO) -> bool:
    """Returns true if chance cannot have changed the index of a finished file unnoticed."""
    end = file.seek(0, 2) - len(MAGIC)
    return any(read_at(file, end - 4, 4))


def _checksum(file: BinaryIO, start: int, end: int) -> int:
    """Returns the CRC of a stretch of the file, which a damaged footer may make as long as the file is."""
    found = 0
    for position in range(start, end, _BLOCK_BYTES):
        found = zlib.crc32(read_at(file, position, min(_BLOCK_BYTES, end - position)), found)
    return found


def _summary(content: bytes) -> Summary:
    found = Summary()
    reader = StreamReader(io.BytesIO(content), skip_magic=True, emit_chunks=True, record_size_limit=len(content))
    for record in reader.records:  # the footer is the last one
        match record:
            case Statistics():
                found.statistics = record
            case Schema():
                found.schemas[record.id] = record
            case Channel():
                found.channels[record.id] = record
            case AttachmentIndex():
                found.attachment_indexes.append(record)
            case ChunkIndex():
                found.chunk_indexes.append(record)
            case MetadataIndex():
                found.metadata_indexes.append(record)
            case _:
                pass
    return found
