"""Zeros in the place of a record, as a disk leaves them after a power cut: what they replace is told, never nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from shared import wire
from shared.errors import UserError
from shared.messages import Heartbeat
from station.recording.described import attachments_at
from station.recording.mcap_file import McapFile
from station.recording.reader import open_recording
from station.recording.repair import repair
from station.recording.writer import PARTIAL


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        file = McapFile(stream, library="test", chunk_bytes=1)
        schema = file.register_schema(wire.schema_name(Heartbeat), wire.schema(Heartbeat))
        channel = file.register_channel("/session/heartbeat", schema_id=schema)
        for number in range(1, 6):
            payload = wire.encode(Heartbeat(number))
            file.add_message(channel, log_ns=number, publish_ns=number, sequence=0, payload=payload)
        file.add_metadata("m", {"a": "b"})
        file.add_attachment("f", b"abc", media_type="", stamp_ns=1)
        file.finish()
    return path


def blank(path: Path, start: int, length: int) -> None:
    content = bytearray(path.read_bytes())
    content[start : start + length] = bytes(length)
    path.write_bytes(content)


@pytest.mark.parametrize("kept", [0, 9])
def test_a_blank_chunk_is_no_chunk_without_messages(path: Path, kept: int) -> None:
    index = open_recording(path).summary.chunk_indexes[2]
    blank(path, index.chunk_start_offset + kept, index.chunk_length - kept)
    with pytest.raises(UserError, match="a chunk is blank"):
        list(open_recording(path).messages())
    done = repair(path)
    assert (done.findings.messages, done.findings.bad_records) == (4, 1)


@pytest.mark.parametrize("kind", ["metadata", "attachment"])
def test_a_blank_metadata_record_or_attachment_is_told(path: Path, kind: str) -> None:
    summary = open_recording(path).summary
    (index,) = summary.metadata_indexes if kind == "metadata" else summary.attachment_indexes
    blank(path, index.offset, index.length)
    if kind == "metadata":
        assert open_recording(path).changed_metadata == ("m",)
    else:
        with pytest.raises(UserError, match="attachment 'f' \\(it is blank\\)"):
            _ = open_recording(path).attachments
    done = repair(path)
    assert (done.findings.messages, done.findings.bad_records) == (5, 1)
    left = open_recording(done.path)
    assert (left.metadata_names - {"repair"}, [*left.attachments]) == (
        (set(), ["f"]) if kind == "metadata" else ({"m"}, [])
    )


def test_a_blank_checksum_is_none_only_where_no_attached_file_has_one(tmp_path: Path) -> None:
    """Zeros are MCAP's word for no checksum: a disk may write them over one, and over what it was of."""
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        file = McapFile(stream, library="test")
        for name in ("a", "b"):
            file.add_attachment(name, b"abcdefgh", media_type="", stamp_ns=1)
        file.finish()
    first, second = open_recording(path).summary.attachment_indexes
    blank(path, first.offset + first.length - 8, 8)
    with pytest.raises(UserError, match="'a' \\(it has lost its checksum"):
        _ = open_recording(path).attachments
    done = repair(path)
    assert (done.findings.bad_records, [*open_recording(done.path).attachments]) == (1, ["b"])
    blank(path, second.offset + second.length - 4, 4)
    assert [*open_recording(path).attachments] == ["a", "b"]


def test_an_attached_file_of_no_length_at_the_files_begin_is_damage(path: Path) -> None:
    index = open_recording(path).summary.attachment_indexes[0]
    with pytest.raises(UserError, match="attachment 'f'"):
        attachments_at(path, [replace(index, offset=0, length=0)])


def test_the_blank_end_of_an_unfinished_file_is_one_loss(path: Path) -> None:
    index = open_recording(path).summary.chunk_indexes[2]
    unfinished = path.with_name(path.name + PARTIAL)
    unfinished.write_bytes(path.read_bytes()[: index.chunk_start_offset] + bytes(1_000_000))
    path.unlink()
    assert repair(unfinished).sentence.endswith(
        ": 2 messages saved; lost: 1000000 bytes of an unfinished record at the end"
    )


def test_a_chunk_that_is_larger_than_its_index_says_is_refused(path: Path) -> None:
    """Otherwise the index might claim a small file, and its chunks unpack to a large one."""
    reader = open_recording(path)
    reader.summary.chunk_indexes[2].uncompressed_size -= 1
    with pytest.raises(UserError, match="not as large as the index says"):
        list(reader.messages())
