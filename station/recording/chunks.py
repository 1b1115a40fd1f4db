"""Reads the records inside a chunk: unpacked, checked, and only those that are wanted."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Container
from typing import NamedTuple

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Schema

MAX_CHUNK_BYTES = 256 * 1024 * 1024
"""No writer makes chunks as large as this: a larger number is damage, or meant to exhaust the memory."""
MAX_MESSAGES = 1_000_000
"""The largest number of messages in a chunk. Ours hold thousands; a million takes some 300 MB beside its bytes."""
HELD_BYTES = 256
"""The memory of a message beside its payload: a tuple and its numbers."""

HEAD = struct.Struct("<BQ")
"""The head of a record: its kind (opcode) and the length of what follows."""
_MESSAGE = struct.Struct("<HIQQ")


class DamageError(Exception):
    """The file's contents cannot have been written so; the text says what is wrong with it."""


class RawMessage(NamedTuple):
    """A message as it stands in the file."""

    log_ns: int
    channel_id: int
    sequence: int
    publish_ns: int
    payload: bytes
    offset: int = 0
    """The offset of its content in all that was unpacked: no other message of a reading has the same."""


def chunk_of(content: bytes) -> Chunk:
    """Returns the chunk in a record's content.

    Raises:
        DamageError: if it is blank, as a disk leaves it: zeros read as a chunk of nothing, without a checksum.
        EndOfFile: if it breaks off.
    """
    stream = io.BytesIO(content)
    chunk = Chunk.read(ReadDataStream(stream))
    if not chunk.uncompressed_size and stream.tell() < len(content):
        raise DamageError("a chunk is blank")
    return chunk


def unpack(chunk: Chunk) -> bytes:
    """Returns the records of a chunk.

    Raises:
        DamageError: if they cannot be unpacked or their CRC is wrong.
    """
    if chunk.uncompressed_size > MAX_CHUNK_BYTES:
        raise DamageError(f"a chunk claims to hold {chunk.uncompressed_size / 1e9:.1f} GB")
    try:
        data = _decompress(chunk)
    except (RuntimeError, ValueError, MemoryError, zstandard.ZstdError) as error:
        raise DamageError(f"a chunk cannot be unpacked ({error})") from error
    if len(data) != chunk.uncompressed_size:
        raise DamageError(f"a chunk holds {len(data)} bytes instead of {chunk.uncompressed_size}")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise DamageError("a chunk's checksum (CRC) is wrong")
    return data


def _decompress(chunk: Chunk) -> bytes:
    if chunk.compression == "lz4":
        # Hardly more than was promised, whatever the compressed bytes say.
        return lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=chunk.uncompressed_size + 1)
    if chunk.compression == "zstd":
        # Not by `decompress`, which takes as much as the frame says of itself, whatever it is allowed.
        return zstandard.ZstdDecompressor().stream_reader(chunk.data).read(chunk.uncompressed_size + 1)
    if chunk.compression == "":
        return chunk.data
    raise ValueError(f"unknown compression '{chunk.compression}'")


def messages(records: bytes, *, wanted: Container[int] | None = None, first_offset: int = 0) -> list[RawMessage]:
    """Returns the messages of the wanted channels (None: of all), by the order of the file.

    Their offsets count from `first_offset`.
    """
    found: list[RawMessage] = []
    position, end = 0, len(records)
    require_few(records)
    try:
        while position < end:
            opcode, length = HEAD.unpack_from(records, position)
            position += HEAD.size
            if opcode == Opcode.MESSAGE:
                channel, sequence, log_ns, publish_ns = _MESSAGE.unpack_from(records, position)
                if wanted is None or channel in wanted:
                    payload = records[position + _MESSAGE.size : position + length]
                    found.append(RawMessage(log_ns, channel, sequence, publish_ns, payload, first_offset + position))
            position += length
    except struct.error as error:
        raise DamageError(f"a chunk's records do not fit together ({error})") from error
    if position != end:
        raise DamageError("a chunk's last record runs over its end")
    return found


def require_few(records: bytes) -> None:
    """Refuses a chunk of which the records would take far more memory than its bytes.

    Raises:
        DamageError: if it holds more records than any writer puts into one.
    """
    if len(records) > MAX_MESSAGES * (HEAD.size + _MESSAGE.size) and _count(records) > MAX_MESSAGES:
        raise DamageError(f"a chunk holds more than {MAX_MESSAGES} messages")


def _count(records: bytes) -> int:
    """Counts the records of a chunk, as far as they fit together; no further than to one more than there may be."""
    position, count = 0, 0
    while position + HEAD.size <= len(records) and count <= MAX_MESSAGES:
        position += HEAD.size + HEAD.unpack_from(records, position)[1]
        count += 1
    return count


def definitions(records: bytes) -> tuple[list[Schema], list[Channel]]:
    """Returns the schemas and channels that a chunk defines."""
    schemas: list[Schema] = []
    channels: list[Channel] = []
    position = 0
    while position < len(records):
        opcode, length = HEAD.unpack_from(records, position)
        position += HEAD.size
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            stream = ReadDataStream(io.BytesIO(records[position : position + length]))
            if opcode == Opcode.SCHEMA:
                schemas.append(Schema.read(stream))
            else:
                channels.append(Channel.read(stream))
        position += length
    return schemas, channels
