"""Recordings of other programs and of other versions are read like our own."""

from __future__ import annotations

from pathlib import Path

import pytest
from google.protobuf import descriptor_pb2
from mcap.writer import CompressionType, IndexType, Writer

from shared import wire
from shared.errors import UserError
from shared.messages import Environment
from station.recording.reader import open_recording
from station.recording.repair import repair


def written(path: Path, *, schema: bytes, payload: bytes, **options: object) -> Path:
    """One message on /environment, by the library."""
    with path.open("wb") as file:
        writer = Writer(file, **options)  # pyright: ignore[reportArgumentType]  # the options are the library's own
        writer.start()
        number = writer.register_channel(
            "/environment", "protobuf", writer.register_schema("repose.Environment", "protobuf", schema)
        )
        writer.add_message(number, 20, payload, 10, 3)
        writer.finish()
    return path


SCHEMA = wire.schema(Environment)
MESSAGE = Environment(stamp_ns=10, temperature_c=21.5, relative_humidity=0.4)


@pytest.mark.parametrize("compression", list(CompressionType))
def test_every_packing_is_read(compression: CompressionType, tmp_path: Path) -> None:
    path = written(tmp_path / "a.mcap", schema=SCHEMA, payload=wire.encode(MESSAGE), compression=compression)
    (item,) = open_recording(path).messages()
    assert (item.topic, item.message, item.publish_ns, item.log_ns) == ("environment", MESSAGE, 10, 20)


def test_a_file_without_message_indexes_is_read(tmp_path: Path) -> None:
    kinds = IndexType.CHUNK
    path = written(tmp_path / "a.mcap", schema=SCHEMA, payload=wire.encode(MESSAGE), index_types=kinds)
    assert [item.message for item in open_recording(path).messages({"environment"})] == [MESSAGE]


@pytest.mark.parametrize(
    "options",
    [
        {"use_chunking": False},
        {"use_statistics": False, "index_types": IndexType.NONE},
        {"repeat_channels": False},
        {"repeat_schemas": False},
        {"repeat_channels": False, "repeat_schemas": False, "index_types": IndexType.CHUNK},
    ],
)
def test_a_file_without_index_is_repaired_and_read(options: dict[str, object], tmp_path: Path) -> None:
    path = written(tmp_path / "a.mcap", schema=SCHEMA, payload=wire.encode(MESSAGE), **options)
    with pytest.raises(UserError, match="station repair"):
        list(open_recording(path).messages())
    assert [item.message for item in open_recording(repair(path).path).messages()] == [MESSAGE]


def test_an_older_message_gets_defaults_and_a_newer_one_loses_only_what_is_new(tmp_path: Path) -> None:
    older = wire.encode(Environment(stamp_ns=10, temperature_c=21.5))
    newer = wire.encode(MESSAGE) + b"\xa2\x06\x03new"  # field 100, a text
    for name, payload, expected in (("old", older, Environment(10, 21.5)), ("new", newer, MESSAGE)):
        path = written(tmp_path / f"{name}.mcap", schema=SCHEMA, payload=payload)
        assert [item.message for item in open_recording(path).messages()] == [expected]


def test_a_topic_that_is_not_known_is_told_and_left_out(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    schema = descriptor_pb2.FileDescriptorSet().SerializeToString()
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        known = writer.register_schema("repose.Environment", "protobuf", SCHEMA)
        foreign = writer.register_schema("theirs.Thing", "protobuf", schema)
        writer.add_message(writer.register_channel("/environment", "protobuf", known), 1, wire.encode(MESSAGE), 1)
        writer.add_message(writer.register_channel("/thing", "protobuf", foreign), 2, b"\x00", 2)
        writer.finish()
    reader = open_recording(path)
    assert reader.topics["thing"].message is None
    assert reader.topics["thing"].count == 1
    assert [item.topic for item in reader.messages()] == ["environment"]
