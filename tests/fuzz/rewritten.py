"""Recordings with valid checksums and impossible content: messages, topics, schemas, times and files replaced."""

from __future__ import annotations

import io
import struct
import zlib
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

from mcap.records import Attachment, Metadata

from shared import topics, wire
from shared.errors import UserError
from station.recording.mcap_file import MAGIC, McapFile
from station.recording.salvage import Block, Salvage
from tests.fuzz.change import INTEGERS, TEXTS, of_bytes, of_text
from tests.fuzz.forged_index import forge
from tests.fuzz.targets.bus import changed


@dataclass(frozen=True)
class Line:
    """A message: its topic and schema, its bytes and times."""

    topic: str
    schema: str
    schema_data: bytes
    encoding: str
    payload: bytes
    log_ns: int
    publish_ns: int


@dataclass(frozen=True)
class Content:
    """The content of a file."""

    lines: tuple[Line, ...]
    files: tuple[tuple[str, bytes], ...]
    metadata: tuple[tuple[str, tuple[tuple[str, str], ...]], ...]


@cache
def content_of(data: bytes) -> Content:
    """Everything in a recording."""
    lines, files, metadata = list[Line](), list[tuple[str, bytes]](), list[Any]()
    with TemporaryDirectory() as folder:
        path = Path(folder) / "seed.mcap"
        path.write_bytes(data)
        salvage = Salvage(path)
        for item in salvage.read():
            if isinstance(item, Block):
                for raw in item.messages:
                    channel = salvage.channels[raw.channel_id]
                    schema = salvage.schemas[channel.schema_id]
                    lines.append(
                        Line(
                            channel.topic,
                            schema.name,
                            schema.data,
                            channel.message_encoding,
                            raw.payload,
                            raw.log_ns,
                            raw.publish_ns,
                        )
                    )
            elif isinstance(item, Attachment):
                files.append((item.name, item.data))
            else:
                assert isinstance(item, Metadata)
                metadata.append((item.name, tuple(item.metadata.items())))
    return Content(tuple(lines), tuple(files), tuple(metadata))


def rewritten(random: Random, data: bytes) -> bytes:
    """A recording with a few things replaced, all checksums right."""
    content = content_of(data)
    for _ in range(random.choice((1, 1, 2, 5))):
        content = random.choice(_CHANGES)(random, content)
    return written(random, content)


def _payload(random: Random, content: Content) -> Content:
    """Several messages of one topic with other values."""
    name = random.choice(sorted({line.topic for line in content.lines}))
    lines, share = list(content.lines), random.choice((0.02, 0.3, 1.0))
    for place, line in enumerate(lines):
        if line.topic == name and random.random() < share:
            lines[place] = replace(line, payload=_other(random, line))
    return replace(content, lines=tuple(lines))


def _other(random: Random, line: Line) -> bytes:
    try:
        cls = topics.topic(line.topic.removeprefix("/")).message
        return changed(random, wire.decode(cls, line.payload))
    except UserError:
        return of_bytes(random, line.payload)


def _one(random: Random, content: Content) -> tuple[list[Line], int]:
    lines = list(content.lines)
    return lines, random.randrange(len(lines)) if lines else -1


def _times(random: Random, content: Content) -> Content:
    lines, place = _one(random, content)
    if place < 0:
        return content
    value = random.choice([number for number in INTEGERS if 0 <= number < 2**64] + [2**64 - 1])
    for place in random.sample(range(len(lines)), random.choice((1, 1, min(40, len(lines))))):
        name = random.choice(("log_ns", "publish_ns"))
        lines[place] = replace(lines[place], **{name: value})
    return replace(content, lines=tuple(lines))


def _topic(random: Random, content: Content) -> Content:
    """A topic under another name, or with another schema or encoding."""
    if not content.lines:
        return content
    old, other = random.choice(content.lines), random.choice(content.lines)
    change: dict[str, Any] = random.choice(
        (
            {"topic": random.choice((other.topic, "/angle/x", "/truth/x", *TEXTS))},
            {"schema": other.schema, "schema_data": other.schema_data},
            {"schema": random.choice(TEXTS)},
            {"schema_data": of_bytes(random, old.schema_data)},
            {"encoding": random.choice(("json", "cdr", ""))},
        )
    )
    try:
        "".join(text for text in change.values() if isinstance(text, str)).encode()
    except UnicodeError:
        return content
    changed_lines = (replace(line, **change) if line.topic == old.topic else line for line in content.lines)
    return replace(content, lines=tuple(changed_lines))


def _without(random: Random, content: Content) -> Content:
    if not content.lines:
        return content
    name = random.choice(content.lines).topic
    return replace(content, lines=tuple(line for line in content.lines if line.topic != name))


def _order(random: Random, content: Content) -> Content:
    lines = list(content.lines)
    if random.random() < 0.5:
        random.shuffle(lines)
    else:
        lines += random.choices(lines, k=50) if lines else []
    return replace(content, lines=tuple(lines))


def _file(random: Random, content: Content) -> Content:
    if not content.files:
        return content
    files = list(content.files)
    place = random.randrange(len(files))
    name, data = files[place]
    files[place] = random.choice(((name, of_text(random, data)), (name, b""), ("calibration.toml", data)))
    return replace(content, files=tuple(files))


def _metadata(random: Random, content: Content) -> Content:
    records = []
    for name, values in content.metadata:
        items = dict(values)
        if random.random() < 0.6 and items:
            items[random.choice([*items])] = random.choice([text for text in TEXTS if text != "\ud800"] + ["-1", "1e9"])
            if random.random() < 0.7:
                items.pop("sha256", None)  # as a writer without checksums
        if random.random() < 0.9:
            records.append((name, tuple(items.items())))
    return replace(content, metadata=tuple(records))


_CHANGES = (_payload, _payload, _payload, _times, _topic, _topic, _without, _order, _file, _metadata)


class _WithOddRecords(McapFile):
    """A writer whose chunks hold records that nobody writes, under a right checksum."""

    def __init__(self, stream: io.BytesIO, random: Random, *, compression: str, chunk_bytes: int) -> None:
        super().__init__(stream, library="fuzz", compression=compression, chunk_bytes=chunk_bytes)
        self._random = random

    def _end_chunk(self) -> None:
        if self._random.random() < 0.5 and self._chunk.records:
            self._chunk.records = bytearray(of_bytes(self._random, bytes(self._chunk.records)))
        super()._end_chunk()


def written(random: Random, content: Content) -> bytes:
    """The content as a file; now and then with odd records in its chunks, or an odd index."""
    stream = io.BytesIO()
    compression, chunk_bytes = random.choice(("lz4", "zstd", "")), random.choice((1, 3000, 1 << 20))
    if random.random() < 0.15:
        file: McapFile = _WithOddRecords(stream, random, compression=compression, chunk_bytes=chunk_bytes)
    else:
        file = McapFile(stream, library="fuzz", compression=compression, chunk_bytes=chunk_bytes)
    for name, data in content.files:
        file.add_attachment(name, data, media_type="text/plain", stamp_ns=0)
    for name, values in content.metadata:
        file.add_metadata(name, dict(values))
    schemas: dict[tuple[str, bytes], int] = {}
    channels: dict[tuple[str, int, str], int] = {}
    for line in content.lines:
        kind = (line.schema, line.schema_data)
        if kind not in schemas:
            schemas[kind] = file.register_schema(line.schema, line.schema_data)
        way = (line.topic, schemas[kind], line.encoding)
        if way not in channels:
            channels[way] = file.register_channel(line.topic, schema_id=schemas[kind], encoding=line.encoding)
        file.add_message(
            channels[way], log_ns=line.log_ns, publish_ns=line.publish_ns, sequence=0, payload=line.payload
        )
    if random.random() < 0.2:
        forge(random, file)
    file.finish()
    data = stream.getvalue()
    return with_odd_index(random, data) if random.random() < 0.15 else data


def with_odd_index(random: Random, data: bytes) -> bytes:
    """The same file with bytes of its summary changed, under a right checksum."""
    end = len(data) - len(MAGIC)
    footer = struct.unpack_from("<QQI", data, end - 20)
    summary = bytearray(of_bytes(random, data[footer[0] : end - 29]))
    tail = data[end - 29 : end - 4]
    crc = zlib.crc32(tail, zlib.crc32(bytes(summary)))
    return data[: footer[0]] + bytes(summary) + tail + struct.pack("<I", crc) + MAGIC
