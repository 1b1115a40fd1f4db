"""Reads what describes a recording: its attached files, and its metadata, of which it tells what was changed.

MCAP has a checksum for the index, which names these records, and one for each attachment, but none for metadata: ours
carry their own.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, AttachmentIndex, Metadata, MetadataIndex

from station.recording.bounded import BROKEN, read_at
from station.recording.chunks import HEAD, DamageError
from station.recording.indexed import damaged
from station.recording.provenance import CHECKSUM, is_intact

Values = dict[str, str]


@dataclass(frozen=True, slots=True)
class Described:
    """The metadata by the names that the index has, without checksums; `changed` are those not as they were written."""

    records: dict[str, Values]
    changed: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Found:
    """A record under the name that the index has; `whole` if it begins and is named as the index says."""

    name: str
    values: Values
    whole: bool


def metadata_at(path: Path, indexes: Sequence[MetadataIndex]) -> Described:
    """Returns the metadata records that an index names.

    Raises:
        UserError: if one cannot be read.
    """
    return described([_record_at(path, index) for index in indexes])


def attachments_at(path: Path, indexes: Sequence[AttachmentIndex]) -> dict[str, bytes]:
    """Returns the attached files that an index names, by name.

    Raises:
        UserError: if one is damaged.
    """
    found: dict[str, bytes] = {}
    with path.open("rb") as file:
        sealed = any_has_checksum(file, indexes)
        for index in indexes:
            try:
                record = attachment_of(read_at(file, index.offset, index.length)[HEAD.size :], sealed=sealed)
            except BROKEN as error:
                raise damaged(path, f"attachment '{index.name}' ({error})") from error
            found[record.name] = record.data
    return found


def any_has_checksum(file: BinaryIO, indexes: Sequence[AttachmentIndex]) -> bool:
    """Returns true if whoever attached the files gave them checksums: zeros in the place of one are none otherwise."""
    return any(any(read_at(file, max(0, index.offset + index.length - 4), 4)) for index in indexes)


def attachment_of(content: bytes, *, sealed: bool = False) -> Attachment:
    """Returns the attachment in a record's content; its CRC, which the library skips, is checked.

    Raises:
        DamageError: if it is wrong, or missing where all are `sealed` by one, or all is blank.
    """
    (crc,) = struct.unpack("<I", content[-4:])
    if sealed and not crc:
        raise DamageError("it has lost its checksum (CRC)")
    if crc and zlib.crc32(content[:-4]) != crc:
        raise DamageError("its checksum (CRC) is wrong")
    stream = io.BytesIO(content)
    found = Attachment.read(ReadDataStream(stream))
    _require_written(found.name or found.data, stream, content)
    return found


def metadata_of(content: bytes) -> Metadata:
    """Returns the metadata in a record's content.

    Raises:
        DamageError: if all is blank.
    """
    stream = io.BytesIO(content)
    found = Metadata.read(ReadDataStream(stream))
    _require_written(found.name or found.metadata, stream, content)
    return found


def _require_written(read: object, stream: io.BytesIO, content: bytes) -> None:
    """Refuses zeros, as a disk leaves them: they read as nothing, before what the record held."""
    if not read and stream.tell() < len(content):
        raise DamageError("it is blank")


def _record_at(path: Path, index: MetadataIndex) -> Found:
    try:
        with path.open("rb") as file:
            content = read_at(file, index.offset, index.length)
        record = Metadata.read(ReadDataStream(io.BytesIO(content[HEAD.size :])))
        head = HEAD.pack(Opcode.METADATA, index.length - HEAD.size)
    except BROKEN as error:
        raise damaged(path, f"metadata '{index.name}' ({error})") from error
    return Found(index.name, record.metadata, whole=content[: HEAD.size] == head and record.name == index.name)


def described(found: Sequence[Found]) -> Described:
    """Gives all of them, the last of several with one name; one without checksum among others with one has lost it."""
    sealed = any(CHECKSUM in record.values for record in found)
    changed = [
        record.name
        for record in found
        if not record.whole or not is_intact(record.values) or (sealed and CHECKSUM not in record.values)
    ]
    values = {record.name: {k: v for k, v in record.values.items() if k != CHECKSUM} for record in found}
    return Described(values, tuple(dict.fromkeys(changed)))
