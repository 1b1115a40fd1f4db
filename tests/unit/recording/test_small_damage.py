"""One changed bit of what has no checksum in MCAP is told, and makes no reader take more memory than the file has."""

from __future__ import annotations

import struct
import tracemalloc
import zlib
from pathlib import Path

import pytest

from shared.errors import UserError
from station.app.verifying import verify
from station.recording.checkup.report import examine
from station.recording.checkup.rules import findings
from station.recording.mcap_file import MAGIC
from station.recording.reader import RecordingReader, open_recording
from station.recording.repair import repair
from station.recording.salvage import Salvage
from station.recording.writer import Recording
from tests.unit.recording import session

FOOTER = len(MAGIC) + 20


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A session whose recorder missed seven messages."""
    with Recording(tmp_path / "a.mcap", provenance=session.provenance()) as recording:
        for receive_ns, topic, message in session.traffic():
            recording.write_message(topic, message, receive_ns=receive_ns)
        recording.add_metadata("recorder", {"missed": "7", "missed camera/corners": "7"})
    return tmp_path / "a.mcap"


def flipped(path: Path, text: bytes, *, record: str = "recorder") -> RecordingReader:
    """The recording with the lowest bit of a text in one of its metadata records flipped."""
    content = bytearray(path.read_bytes())
    index = next(each for each in open_recording(path).summary.metadata_indexes if each.name == record)
    content[content.index(text, index.offset)] ^= 1
    path.write_bytes(content)
    return open_recording(path)


def overwritten(path: Path, offset: int, value: bytes) -> Path:
    content = bytearray(path.read_bytes())
    content[offset : offset + len(value)] = value
    path.write_bytes(content)
    return path


@pytest.mark.parametrize("text", [b"recorder", b"sha256", b"missed"])
def test_a_flipped_bit_of_a_metadata_record_is_told_and_loses_nothing(path: Path, text: bytes) -> None:
    reader = flipped(path, text)
    assert reader.changed_metadata == ("recorder",)
    report = examine(reader)
    assert any("metadata 'recorder' as it was written" in str(finding) for finding in findings(report))
    content = next(part for part in verify(path).parts if part.name == "content")
    assert content.state == "different"
    if text == b"recorder":
        assert report.recorder["missed"] == 7


def test_a_flipped_bit_in_the_name_of_a_part_loses_no_part(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with Recording(path, provenance=session.provenance(), flush_every_s=0.02, split_bytes=20_000) as recording:
        for receive_ns, topic, message in session.traffic():
            recording.write_message(topic, message, receive_ns=receive_ns)
    whole = open_recording(path).message_count
    assert len(list(tmp_path.glob("*.mcap"))) > 1
    reader = flipped(path, b"part", record="part")
    assert reader.message_count == whole
    assert reader.changed_metadata == ("part",)


def test_the_note_of_a_repair_is_sealed(path: Path, tmp_path: Path) -> None:
    repair(path, out=tmp_path / "b.mcap")
    reader = open_recording(tmp_path / "b.mcap")
    assert "repair" in reader.metadata
    assert reader.changed_metadata == ()


@pytest.mark.parametrize("value", [2**63, 2**64 - 1])
def test_a_length_beyond_all_numbers_is_damage(path: Path, value: int) -> None:
    """The length of a chunk's data, which has no checksum: it follows two times, a size, a CRC and the compression."""
    first = open_recording(path).summary.chunk_indexes[0].chunk_start_offset
    overwritten(path, first + 9 + 8 + 8 + 8 + 4 + 4 + len("lz4"), struct.pack("<Q", value))
    with pytest.raises(UserError, match="is damaged"):
        list(open_recording(path).messages())
    with pytest.raises(UserError, match="is damaged"):
        list(open_recording(path).batches({"camera/corners"}))
    list(Salvage(path).read())


def large(path: Path) -> Path:
    """The same file with 64 MB of zeros before its index, which knows nothing of them: a hole, which costs no disk."""
    content = path.read_bytes()
    start = struct.unpack_from("<Q", content, len(content) - FOOTER)[0]
    moved = start + (64 << 20)
    footer = struct.pack("<BQQQ", 2, 20, moved, 0)
    index = content[start : -FOOTER - 9]
    crc = struct.pack("<I", zlib.crc32(footer, zlib.crc32(index)))
    with path.open("r+b") as file:
        file.seek(start)
        file.truncate()
        file.seek(moved)
        file.write(index + footer + crc + MAGIC)
    return path


def peak_of_opening(path: Path, words: str) -> int:
    tracemalloc.start()
    try:
        with pytest.raises(UserError, match=words):
            assert open_recording(path).metadata
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_a_footer_that_points_at_the_files_beginning_takes_no_memory(path: Path) -> None:
    assert open_recording(large(path)).metadata
    end = path.stat().st_size
    for crc in (None, bytes(4)):  # with a checksum that is wrong, and with none
        overwritten(path, end - FOOTER, struct.pack("<Q", len(MAGIC)))
        if crc is not None:
            overwritten(path, end - len(MAGIC) - 4, crc)
        assert peak_of_opening(path, "is damaged") < 16 << 20


def test_a_metadata_text_that_claims_any_length_takes_no_memory(path: Path) -> None:
    reader = open_recording(large(path))
    index = reader.summary.metadata_indexes[0]
    overwritten(path, index.offset + 9, struct.pack("<I", 2**26))
    assert peak_of_opening(path, "metadata") < 16 << 20
