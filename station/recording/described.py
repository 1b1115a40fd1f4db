"""Reads the metadata records of a recording, and tells which are not as they were written.

MCAP has a checksum for the index, which names these records, and none for the records themselves: ours carry their own.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Metadata, MetadataIndex

from station.recording.bounded import read_at
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


def record_at(file: BinaryIO, index: MetadataIndex) -> Found:
    """The record that an index points at.

    Raises:
        errors in `BROKEN`: if there is none.
    """
    content = read_at(file, index.offset, index.length)
    record = Metadata.read(ReadDataStream(io.BytesIO(content[9:])))
    head = bytes([Opcode.METADATA]) + (index.length - 9).to_bytes(8, "little")
    return Found(index.name, record.metadata, whole=content[:9] == head and record.name == index.name)


def described(found: Sequence[Found]) -> Described:
    """All of them, the last of several with one name; one without checksum among others with one has lost it."""
    sealed = any(CHECKSUM in record.values for record in found)
    changed = [
        record.name
        for record in found
        if not record.whole or not is_intact(record.values) or (sealed and CHECKSUM not in record.values)
    ]
    values = {record.name: {k: v for k, v in record.values.items() if k != CHECKSUM} for record in found}
    return Described(values, tuple(dict.fromkeys(changed)))
