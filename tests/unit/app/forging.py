"""Recordings written anew with a few messages changed, dropped or added, as a forger would: every CRC is right."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.records import Attachment, Metadata

from shared import wire
from shared.errors import UserError
from shared.messages import Message
from station.recording.mcap_file import McapFile
from station.recording.reader import RecordingReader, open_recording
from station.recording.salvage import Block, Salvage


@dataclass(frozen=True)
class Item:
    """One message of a recording; `message` is None where this version has no class for it."""

    topic: str
    message: Message | None
    payload: bytes
    log_ns: int
    publish_ns: int

    def with_message(self, message: Message) -> Item:
        """The same with another content."""
        return Item(self.topic, message, wire.encode(message), self.log_ns, self.publish_ns)


Edit = Callable[[Iterator[Item]], Iterable[Item]]


def forged(source: Path, target: Path, edit: Edit) -> Path:
    """Writes `source` as `target` with its messages edited; metadata and attachments are those of the source."""
    salvage, infos = Salvage(source), open_recording(source)
    with target.open("wb") as stream:
        output = McapFile(stream, library="forger")
        numbers: dict[str, int] = {}

        def taken() -> Iterator[Item]:
            for item in salvage.read():
                if isinstance(item, Block):
                    for raw in item.messages:
                        name = salvage.channels[raw.channel_id].topic.removeprefix("/")
                        yield Item(name, _decoded(infos, name, raw.payload), raw.payload, raw.log_ns, raw.publish_ns)
                elif isinstance(item, Attachment):
                    output.add_attachment(item.name, item.data, media_type=item.media_type, stamp_ns=item.log_time)
                else:
                    assert isinstance(item, Metadata)
                    output.add_metadata(item.name, item.metadata)

        for item in edit(taken()):
            if item.topic not in numbers:
                channel = next(one for one in salvage.channels.values() if one.topic == f"/{item.topic}")
                schema = salvage.schemas[channel.schema_id]
                number = output.register_schema(schema.name, schema.data, encoding=schema.encoding)
                numbers[item.topic] = output.register_channel(
                    channel.topic, schema_id=number, encoding=channel.message_encoding
                )
            output.add_message(
                numbers[item.topic], log_ns=item.log_ns, publish_ns=item.publish_ns, sequence=0, payload=item.payload
            )
        output.finish()
    return target


def _decoded(reader: RecordingReader, topic: str, payload: bytes) -> Message | None:
    cls = reader.topics[topic].message
    try:
        return None if cls is None else wire.decode(cls, payload)
    except UserError:
        return None
