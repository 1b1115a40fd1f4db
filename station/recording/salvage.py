"""Reads an MCAP file from its beginning as far as it goes, whatever has happened to its end."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Metadata, Schema
from mcap.summary import Summary

from shared.errors import UserError
from station.recording.bounded import BROKEN
from station.recording.chunks import HEAD, RawMessage, chunk_of, definitions, messages, require_few
from station.recording.described import any_has_checksum, attachment_of, metadata_of
from station.recording.index import has_checksum, read_index
from station.recording.index_entries import index_entries_of
from station.recording.mcap_file import MAGIC
from station.recording.recorded import class_of, message_of
from station.recording.room import BombError, Room
from station.recording.walk import Gap, Record, holds_nothing, walk


@dataclass(slots=True)
class Findings:
    """The counts of what a salvage could and could not read."""

    messages: int = 0
    bad_records: int = 0
    unknown_records: int = 0
    """Records of a kind that the format does not have there: the mark of their kind is damaged, or they are foreign."""
    bombs: int = 0
    """Chunks that would make more of the file than measurements can be packed into it."""
    unknown_messages: int = 0
    """Messages whose topic was defined in a part that cannot be read."""
    malformed: dict[str, int] = field(default_factory=dict[str, int])
    """Payloads by topic that are no message of it; they are saved as they are."""
    lost_bytes: int = 0
    """The bytes after the last whole record."""
    cut_off: bool = False
    """True if the file does not say where its data ends: nobody can tell what came after."""


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
    _sealed: bool = False
    """True if the attached files have checksums, as far as the index tells."""

    def read(self) -> Iterator[Block | Attachment | Metadata]:
        """Yields everything that can be read, in the order of the file.

        Raises:
            UserError: if the file cannot be opened or is no MCAP file at all.
        """
        try:
            with self.path.open("rb") as file:
                if file.read(len(MAGIC)) != MAGIC:
                    raise UserError(f"Expected a recording (MCAP), but {self.path} is empty or another kind of file")
                summary = self._index(file)
                if summary is not None:
                    # It names the topics once more: good to know if the chunk that did is damaged.
                    self._learn([*summary.schemas.values()], [*summary.channels.values()])
                yield from self._read_records(file, summary)
        except OSError as error:
            raise UserError(f"Expected a recording at {self.path}, but it cannot be read: {error.strerror}") from error

    def _index(self, file: BinaryIO) -> Summary | None:
        """Returns the index of a finished file, if it can be read."""
        try:
            return read_index(file)
        except (*BROKEN, OSError):  # OSError: shorter than a footer, so that seeking back fails
            return None

    def _read_records(self, file: BinaryIO, summary: Summary | None) -> Iterator[Block | Attachment | Metadata]:
        size = file.seek(0, 2)
        room = Room(size)
        sure = summary if summary is not None and has_checksum(file) else None
        self._sealed = sure is not None and any_has_checksum(file, sure.attachment_indexes)
        for record in walk(file, index_entries_of(sure, size=size)):
            if isinstance(record, Gap):
                self._take_note(record)
                continue
            try:
                item = self._item(record, room, indexed=sure is not None)
            except BombError:
                self.findings.bombs += 1
            except BROKEN:
                self.findings.bad_records += 1
            else:
                if item is not None:
                    yield item

    def _take_note(self, gap: Gap) -> None:
        if gap.last:
            self.findings.lost_bytes += gap.length
            self.findings.cut_off = True
        else:
            self.findings.bad_records += 1

    def _item(self, record: Record, room: Room, *, indexed: bool) -> Block | Attachment | Metadata | None:
        content = record.content
        if record.opcode == Opcode.CHUNK:
            return self._block(room.unpacked(chunk_of(content)))
        if record.opcode == Opcode.ATTACHMENT:
            return attachment_of(content, sealed=self._sealed)
        if record.opcode == Opcode.METADATA:
            read = metadata_of(content)
            return Metadata(name=record.name or read.name, metadata=read.metadata)
        if record.opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):  # outside of chunks
            return self._block(HEAD.pack(record.opcode, len(content)) + content)
        if not holds_nothing(record, indexed=indexed):
            self.findings.unknown_records += 1
        return None

    def _learn(self, schemas: list[Schema], channels: list[Channel]) -> None:
        self.schemas.update({schema.id: schema for schema in schemas})
        self.channels.update({channel.id: channel for channel in channels})

    def _block(self, records: bytes) -> Block | None:
        require_few(records)
        self._learn(*definitions(records))
        found = messages(records)
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
        """Returns true for a channel that is there with its schema, if it has one.

        Without it nobody can read its messages.
        """
        channel = self.channels.get(channel_id)
        return channel is not None and channel.schema_id in {0, *self.schemas}
