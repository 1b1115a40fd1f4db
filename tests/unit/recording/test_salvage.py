"""A salvage reads what has a schema, and counts what has lost it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mcap.data_stream import RecordBuilder
from mcap.records import Channel, Header, McapRecord, Message, Schema

from station.recording.mcap_file import MAGIC
from station.recording.reader import open_recording
from station.recording.repair import repair
from station.recording.salvage import Block, Salvage


def written(path: Path, records: Sequence[McapRecord]) -> Path:
    """A file that ends after these records, as a killed session leaves it."""
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    path.write_bytes(MAGIC + builder.end())
    return path


def channel(number: int, *, schema: int) -> Channel:
    return Channel(id=number, topic=f"/topic{number}", message_encoding="json", metadata={}, schema_id=schema)


def message(number: int, at: int) -> Message:
    return Message(channel_id=number, log_time=at, publish_time=at, sequence=at, data=b"{}")


RECORDS = (
    Header(profile="", library=""),
    Schema(id=1, name="Known", encoding="jsonschema", data=b"{}"),
    channel(1, schema=1),
    channel(2, schema=7),  # whose schema was lost
    channel(3, schema=0),  # which needs none
    *(message(number, at) for at, number in enumerate((1, 2, 3, 2, 4, 1), start=1)),
)


def test_messages_without_a_schema_or_a_channel_are_counted_and_not_handed_on(tmp_path: Path) -> None:
    salvage = Salvage(written(tmp_path / "a.mcap", RECORDS))
    handed = [one.channel_id for item in salvage.read() if isinstance(item, Block) for one in item.messages]
    assert handed == [1, 3, 1]
    assert (salvage.findings.messages, salvage.findings.unknown_messages) == (3, 3)
    assert (salvage.findings.bad_records, salvage.findings.lost_bytes) == (0, 0)


def test_a_repair_leaves_them_out_and_says_how_many(tmp_path: Path) -> None:
    done = repair(written(tmp_path / "a.mcap", RECORDS))
    assert done.findings.unknown_messages == 3
    reader = open_recording(done.path)
    assert set(reader.topics) == {"topic1", "topic3"}
    assert reader.metadata["repair"]["unknown_messages"] == "3"
