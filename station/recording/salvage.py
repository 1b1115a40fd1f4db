"""Reads an MCAP file from its beginning as far as it goes, whatever has happened to its end."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Metadata, Schema

from shared.errors import UserError
from station.recording.bounded import BROKEN
from station.recording.chunks import MAX_CHUNK_BYTES, RawMessage, definitions, messages, unpack
from station.recording.index import read_index
from station.recording.mcap_file import MAGIC
from station.recording.reader import attachment_of, class_of, message_of

_HEADER = struct.Struct("<BQ")


@dataclass(slots=True)
class Findings:
    """The counts of what a salvage could and could not read."""

    messages: int = 0
    bad_records: int = 0
    unknown_messages: int = 0
    """Messages whose topic was defined in a part that cannot be read."""
    malformed: dict[str, int] = field(default_factory=dict[str, int])
    """Payloads by topic that are no message of it; they are saved as they are."""
    lost_bytes: int = 0
    """The bytes after the last whole record."""


@dataclass(frozen=True, slots=True)
class Block:
    """Messages that stood together, in the order of the file."""

    messages: tuple[RawMessage, ...]


@dataclass
class Salvage:
    """One pass over a file; `schemas` and `channels` grow while it is read."""

    path: Path
    findings: Findings = field(default_factory=Findings)
    schemas: dict[int, Schema] = field(default_factory=dict[int, Schema])
    channels: dict[int, Channel] = field(default_factory=dict[int, Channel])

    def read(self) -> Iterator[Block | Attachment | Metadata]:
        """Everything that can be read, in the order of the file.

        Raises:
            UserError: if the file cannot be opened or is no MCAP file at all.
        """
        try:
            with self.path.open("rb") as file:
                if file.read(len(MAGIC)) != MAGIC:
                    raise UserError(f"Expected a recording (MCAP), but {self.path} is empty or another kind of file")
                self._learn_from_summary(file)
                yield from self._read_records(file)
        except OSError as error:
            raise UserError(f"Expected a recording at {self.path}, but it cannot be read: {error.strerror}") from error

    def _learn_from_summary(self, file: BinaryIO) -> None:
        """A finished file names its topics once more at its end: good to know if the chunk that did is damaged."""
        try:
            summary = read_index(file)
        except (*BROKEN, OSError):  # OSError: shorter than a footer, so that seeking back fails
            return
        if summary is not None:
            self._learn([*summary.schemas.values()], [*summary.channels.values()])

    def _read_records(self, file: BinaryIO) -> Iterator[Block | Attachment | Metadata]:
        size = file.seek(0, 2)
        position = len(MAGIC)
        while position + _HEADER.size <= size:
            file.seek(position)
            opcode, length = _HEADER.unpack(file.read(_HEADER.size))
            if length > size - position - _HEADER.size or length > MAX_CHUNK_BYTES:
                break
            if opcode == Opcode.DATA_END:
                return
            content = file.read(length)
            position += _HEADER.size + length
            try:
                item = self._item(opcode, content)
            except BROKEN:
                self.findings.bad_records += 1
                continue
            if item is not None:
                yield item
        self.findings.lost_bytes = size - position

    def _item(self, opcode: int, content: bytes) -> Block | Attachment | Metadata | None:
        if opcode == Opcode.CHUNK:
            records = unpack(Chunk.read(ReadDataStream(io.BytesIO(content))))
            self._learn(*definitions(records))
            return self._block(messages(records))
        if opcode == Opcode.ATTACHMENT:
            return attachment_of(content)
        if opcode == Opcode.METADATA:
            return Metadata.read(ReadDataStream(io.BytesIO(content)))
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):  # outside of chunks
            record = _HEADER.pack(opcode, len(content)) + content
            self._learn(*definitions(record))
            return self._block(messages(record))
        return None

    def _learn(self, schemas: list[Schema], channels: list[Channel]) -> None:
        self.schemas.update({schema.id: schema for schema in schemas})
        self.channels.update({channel.id: channel for channel in channels})

    def _block(self, found: list[RawMessage]) -> Block | None:
        known = tuple(message for message in found if self._is_known(message.channel_id))
        self.findings.messages += len(known)
        self.findings.unknown_messages += len(found) - len(known)
        return Block(known) if known else None

    def count_malformed(self, raw: RawMessage) -> None:
        """Counts a known message if it is none of its topic."""
        channel = self.channels[raw.channel_id]
        topic, schema = channel.topic.removeprefix("/"), self.schemas.get(channel.schema_id)
        cls = class_of(topic, schema.name if schema else "")
        if cls is not None and message_of(cls, raw) is None:
            self.findings.malformed[topic] = self.findings.malformed.get(topic, 0) + 1

    def _is_known(self, channel_id: int) -> bool:
        """True for a channel that is there with its schema, if it has one: without it nobody can read its messages."""
        channel = self.channels.get(channel_id)
        return channel is not None and channel.schema_id in {0, *self.schemas}
