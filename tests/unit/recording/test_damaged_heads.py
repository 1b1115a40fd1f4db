"""The nine bytes at the head of a record, which have no checksum: a flipped bit costs nothing, or is told."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from mcap.opcode import Opcode

from station.recording.chunks import HEAD
from station.recording.index_entries import index_entries_of
from station.recording.mcap_file import MAGIC, McapFile
from station.recording.reader import RecordingReader, open_recording
from station.recording.repair import Repaired, repair
from station.recording.walk import Record, walk
from station.recording.writer import PARTIAL, Recording
from tests.unit.recording import session


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session in many chunks whose recorder missed seven messages."""
    path = tmp_path_factory.mktemp("whole") / "whole.mcap"
    with Recording(path, provenance=session.provenance(), flush_every_s=1.0) as recording:
        for receive_ns, topic, message in list(session.traffic())[::60]:
            recording.write_message(topic, message, receive_ns=receive_ns)
        recording.add_metadata("recorder", {"missed": "7"})
    return path


Contents = tuple[tuple[tuple[int, str, bytes], ...], dict[str, dict[str, str]], dict[str, bytes]]


def contents(reader: RecordingReader) -> Contents:
    messages = tuple((one.log_ns, one.topic, one.payload) for one in reader.messages(truth=True))
    described = {name: values for name, values in reader.metadata.items() if name != "repair"}
    return messages, described, reader.attachments


def repaired(content: bytes, folder: Path, *, partial: bool) -> Repaired:
    path = folder / (f"a.mcap{PARTIAL}" if partial else "a.mcap")
    path.write_bytes(content)
    (folder / "b.mcap").unlink(missing_ok=True)
    return repair(path, out=folder / "b.mcap")


def data_records(path: Path) -> Iterator[Record]:
    """The records of the data, found without their index."""
    with path.open("rb") as file:
        for record in walk(file, index_entries_of(None, size=path.stat().st_size)):
            assert isinstance(record, Record)
            yield record


def flips(path: Path, *, bits: range) -> Iterator[tuple[int, bytes]]:
    """The kind of a record, and the file with one bit of its head flipped."""
    content = path.read_bytes()
    for record in data_records(path):
        for bit in bits:
            changed = bytearray(content)
            changed[record.offset + bit // 8] ^= 1 << bit % 8
            yield record.opcode, bytes(changed)


@pytest.mark.parametrize("bits", [range(8), range(8, 72, 7)], ids=["kind", "length"])
def test_a_finished_file_loses_nothing_by_a_damaged_head(whole: Path, tmp_path: Path, bits: range) -> None:
    expected = contents(open_recording(whole))
    for opcode, content in flips(whole, bits=bits):
        if opcode in (Opcode.CHUNK, Opcode.METADATA, Opcode.ATTACHMENT):
            done = repaired(content, tmp_path, partial=False)
            assert contents(open_recording(done.path)) == expected


def test_an_unfinished_file_says_what_it_loses_by_a_damaged_kind(whole: Path, tmp_path: Path) -> None:
    """Without an index nobody knows what the record was: it is lost, and counted."""
    expected = contents(open_recording(whole))
    last = max(record.offset + len(record.content) for record in data_records(whole)) + HEAD.size
    for _, content in flips(whole, bits=range(8)):
        done = repaired(content[:last], tmp_path, partial=True)
        assert contents(open_recording(done.path)) == expected or not done.sentence.endswith("lost: nothing")


def test_a_file_that_was_cut_off_between_two_records_does_not_claim_to_be_whole(whole: Path, tmp_path: Path) -> None:
    """Nobody can tell what would have come after."""
    content = whole.read_bytes()
    for record in data_records(whole):
        done = repaired(content[: record.offset], tmp_path, partial=True)
        assert done.sentence.endswith("lost: nothing that can be told, as the file was never finished")


def test_a_name_that_was_damaged_is_taken_from_the_index(whole: Path, tmp_path: Path) -> None:
    content = bytearray(whole.read_bytes())
    place = next(one for one in open_recording(whole).summary.metadata_indexes if one.name == "recorder").offset
    content[content.index(b"recorder", place)] ^= 1
    done = repaired(bytes(content), tmp_path, partial=False)
    assert open_recording(done.path).metadata["recorder"]["missed"] == "7"


@pytest.mark.parametrize("kind", [0x1C, 0x8C])
def test_a_record_of_an_unknown_kind_is_told(whole: Path, tmp_path: Path, kind: int) -> None:
    summary = open_recording(whole).summary
    place = next(one for one in summary.metadata_indexes if one.name == "recorder")
    content = bytearray(whole.read_bytes())[: place.offset + place.length]
    content[place.offset] = kind
    done = repaired(bytes(content), tmp_path, partial=True)
    assert "1 records of an unknown kind" in done.sentence
    assert open_recording(done.path).metadata["repair"]["unknown_records"] == "1"


def test_an_index_without_a_checksum_costs_nothing_that_can_be_read_without_it(whole: Path, tmp_path: Path) -> None:
    """Other writers leave it out: then a changed place in the index is as likely as a changed head."""
    content = bytearray(whole.read_bytes())
    content[-len(MAGIC) - 4 : -len(MAGIC)] = bytes(4)
    first = open_recording(whole).summary.chunk_indexes[0].chunk_start_offset
    start = int.from_bytes(content[-len(MAGIC) - 20 : -len(MAGIC) - 12], "little")
    content[content.index(first.to_bytes(8, "little"), start)] ^= 1
    done = repaired(bytes(content), tmp_path, partial=False)
    assert contents(open_recording(done.path)) == contents(open_recording(whole))
    assert done.sentence.endswith("lost: nothing")


@pytest.mark.parametrize(
    ("entries", "number"),
    [
        ("_chunk_indexes", "chunk_length"),
        ("_chunk_indexes", "message_index_length"),
        ("_metadata_indexes", "length"),
        ("_attachment_indexes", "length"),
    ],
)
@pytest.mark.parametrize("length", [0, 2**40])
def test_an_index_with_lengths_that_cannot_be_costs_nothing(
    tmp_path: Path, entries: str, number: str, length: int
) -> None:
    """The first writers of the format in Go gave each chunk a length of 0."""
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        file = McapFile(stream, library="test", chunk_bytes=1)
        channel = file.register_channel("/a", schema_id=file.register_schema("x", b""))
        for at_ns in range(5):
            file.add_message(channel, log_ns=at_ns, publish_ns=at_ns, sequence=0, payload=b"abc")
            file.add_metadata(f"m{at_ns}", {"a": "b"})
            file.add_attachment(f"f{at_ns}", b"abc", media_type="", stamp_ns=1)
        held: list[Any] = getattr(file, entries)
        held[:] = [replace(one, **{number: length}) for one in held]
        file.finish()
    done = repair(path)
    assert (done.findings.messages, done.findings.bad_records, done.findings.lost_bytes) == (5, 0, 0)
    reader = open_recording(done.path)
    assert (len(reader.metadata), len(reader.attachments)) == (6, 5)
