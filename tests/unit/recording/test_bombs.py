"""A small file that would be a large one: refused in a sentence, before the memory is taken."""

from __future__ import annotations

import io
import tracemalloc
import zlib
from dataclasses import replace
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk

from shared import wire
from shared.errors import UserError
from shared.foxglove import Log
from shared.messages import Heartbeat, Message, Sample
from station.recording import chunks, file_reader, in_order, mcap_file
from station.recording.chunks import DamageError, messages, unpack
from station.recording.mcap_file import McapFile
from station.recording.reader import open_recording
from station.recording.repair import repair

LARGE = 400 * 2**20


def packed(kind: str, size: int) -> bytes:
    """Returns `size` packed zeros, without ever having them all."""
    if kind == "lz4":
        compressor = lz4.frame.LZ4FrameCompressor()
        parts = [compressor.begin()]
    else:
        compressor = zstandard.ZstdCompressor().compressobj(size=size)
        parts = list[bytes]()
    parts += [compressor.compress(bytes(2**20)) for _ in range(size // 2**20)]
    return b"".join([*parts, compressor.flush()])


@pytest.mark.parametrize("kind", ["lz4", "zstd"])
@pytest.mark.parametrize("claimed", [1000, 2**20])
def test_a_chunk_that_holds_more_than_it_says_takes_no_more_than_it_says(kind: str, claimed: int) -> None:
    bomb = packed(kind, LARGE)
    assert len(bomb) < LARGE / 200
    chunk = Chunk(kind, bomb, 0, 0, 0, claimed)
    tracemalloc.start()
    try:
        with pytest.raises(DamageError, match="holds"):
            unpack(chunk)
        assert tracemalloc.get_traced_memory()[1] < 2**24
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("kind", ["lz4", "zstd"])
def test_what_a_chunk_rightly_holds_is_unpacked(kind: str) -> None:
    data = bytes(range(256)) * 1000
    raw = lz4.frame.compress(data) if kind == "lz4" else zstandard.compress(data)
    assert unpack(Chunk(kind, raw, 0, 0, zlib.crc32(data), len(data))) == data


def test_a_chunk_of_nothing_but_messages_without_content_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chunks, "MAX_MESSAGES", 1000)
    stream = io.BytesIO()
    file = McapFile(stream, library="test", compression="")
    schema = file.register_schema("x", b"")
    channel = file.register_channel("/x", schema_id=schema)
    records = bytearray()
    for number in range(1001):
        file.add_message(channel, log_ns=number, publish_ns=number, sequence=0, payload=b"")
        records = file._chunk.records  # pyright: ignore[reportPrivateUsage]: as they are laid out
    with pytest.raises(DamageError, match="more than 1000 messages"):
        messages(bytes(records))


def _recorded(path: Path, *, same_time: bool = False, overlap: bool = False) -> Path:
    """A file of twenty chunks; with equal times, or with an index that names one of them again and again."""
    with path.open("wb") as stream:
        file = McapFile(stream, library="test", chunk_bytes=1)
        schema = file.register_schema("repose.Heartbeat", wire.schema(Heartbeat))
        channel = file.register_channel("/session/heartbeat", schema_id=schema)
        for number in range(20):
            at_ns = 1 if same_time else number
            file.add_message(
                channel, log_ns=at_ns, publish_ns=at_ns, sequence=0, payload=wire.encode(Heartbeat(number + 1))
            )
        if overlap:
            indexes = file._chunk_indexes  # pyright: ignore[reportPrivateUsage]: as a forger would write them
            indexes += indexes[:1] * 1000
        file.finish()
    return path


def test_an_index_that_names_the_same_bytes_again_and_again_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="its records overlap"):
        open_recording(_recorded(tmp_path / "a.mcap", overlap=True))


def test_chunks_that_all_overlap_in_time_are_held_only_as_far_as_memory_allows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = open_recording(_recorded(tmp_path / "a.mcap", same_time=True))
    assert len(list(recording.messages())) == 20
    monkeypatch.setattr(in_order, "MAX_HELD_BYTES", 2_000)
    with pytest.raises(UserError, match="overlap in time"):
        list(recording.messages())


def _packed(path: Path, *, topic: str, cls: type[Message], payload: bytes, count: int) -> Path:
    """A file of so many equal messages."""
    with path.open("wb") as stream:
        file = McapFile(stream, library="test")
        schema = file.register_schema(wire.schema_name(cls), wire.schema(cls))
        channel = file.register_channel(f"/{topic}", schema_id=schema)
        for _ in range(count):
            file.add_message(channel, log_ns=1, publish_ns=1, sequence=0, payload=payload)
        file.finish()
    return path


def test_a_small_file_that_would_be_a_large_one_is_refused_when_it_is_opened(tmp_path: Path) -> None:
    payload = wire.encode(Log(message="x" * 2**16))
    bomb = _packed(tmp_path / "a.mcap", topic="log", cls=Log, payload=payload, count=300)
    assert bomb.stat().st_size < 150_000
    with pytest.raises(UserError, match="claims 20 MB"):
        open_recording(bomb)
    fine = _packed(tmp_path / "b.mcap", topic="log", cls=Log, payload=payload, count=200)
    assert len(list(open_recording(fine).messages())) == 200


def test_more_samples_than_any_session_takes_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = _packed(tmp_path / "a.mcap", topic="session/sample", cls=Sample, payload=wire.encode(Sample(run=1)), count=9)
    monkeypatch.setattr(file_reader, "MOST_SAMPLES", 9)
    assert len(open_recording(path).samples()) == 9
    monkeypatch.setattr(file_reader, "MOST_SAMPLES", 8)
    with pytest.raises(UserError, match="at most 8 samples"):
        open_recording(path).samples()


def test_the_limits_are_not_reached_by_our_own_recordings() -> None:
    assert 100 * mcap_file.CHUNK_BYTES < in_order.MAX_HELD_BYTES
    assert chunks.MAX_MESSAGES * 30 > 10 * mcap_file.CHUNK_BYTES


def bomb(path: Path) -> Path:
    """A chunk of 200 MB of records without content and kind, in some kB, and a message behind it."""
    raw = bytes(9 * (200_000_000 // 9))
    with path.open("wb") as stream:
        file = McapFile(stream, library="test", compression="zstd")
        Chunk("zstd", zstandard.compress(raw), 0, 0, 0, len(raw)).write(builder := RecordBuilder())
        stream.write(builder.end())
        schema = file.register_schema(wire.schema_name(Heartbeat), wire.schema(Heartbeat))
        channel = file.register_channel("/session/heartbeat", schema_id=schema)
        file.add_message(channel, log_ns=1, publish_ns=1, sequence=0, payload=wire.encode(Heartbeat(1)))
        file.finish()
    return path


def test_a_repair_unpacks_no_more_than_a_reader_does(tmp_path: Path) -> None:
    path = bomb(tmp_path / "a.mcap")
    assert path.stat().st_size < 20_000
    tracemalloc.start()
    try:
        done = repair(path)
        assert tracemalloc.get_traced_memory()[1] < 2**24
    finally:
        tracemalloc.stop()
    assert "1 chunks that claim to hold far more" in done.sentence
    assert open_recording(done.path).message_count == 1
    assert open_recording(done.path).metadata["repair"]["bombs"] == "1"


@pytest.mark.parametrize("kind", ["metadata", "attachment"])
def test_an_index_that_names_a_record_again_and_again_is_refused(tmp_path: Path, kind: str) -> None:
    """A metadata record of a megabyte under fifteen hundred names took 1.5 GB."""
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        file = McapFile(stream, library="test")
        channel = file.register_channel("/session/heartbeat", schema_id=file.register_schema("repose.Heartbeat", b""))
        file.add_message(channel, log_ns=1, publish_ns=1, sequence=0, payload=b"")
        if kind == "metadata":
            file.add_metadata("a", {"text": "x" * 1000})
            file._metadata_indexes.append(replace(file._metadata_indexes[0], name="b"))  # pyright: ignore[reportPrivateUsage]
        else:
            file.add_attachment("a", b"x" * 1000, media_type="", stamp_ns=1)
            file._attachment_indexes.append(file._attachment_indexes[0])  # pyright: ignore[reportPrivateUsage]
        file.finish()
    with pytest.raises(UserError, match="its records overlap"):
        open_recording(path)


def test_message_indexes_that_claim_any_length_are_read_no_further_than_to_the_next_chunk(tmp_path: Path) -> None:
    """Each of 2500 chunks held the rest of a file of a megabyte, together 2.2 GB."""
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        file = McapFile(stream, library="test", chunk_bytes=1)
        schema = file.register_schema(wire.schema_name(Sample), wire.schema(Sample))
        channel = file.register_channel("/session/sample", schema_id=schema)
        for run in range(1, 401):
            file.add_message(channel, log_ns=1, publish_ns=1, sequence=0, payload=wire.encode(Sample(run=run)))
        indexes = file._chunk_indexes  # pyright: ignore[reportPrivateUsage]: as a forger would write them
        indexes[:] = [replace(index, message_index_length=2**40) for index in indexes]
        file.add_attachment("a", bytes(2**20), media_type="", stamp_ns=1)
        file.finish()
    reader = open_recording(path)
    tracemalloc.start()
    try:
        assert [sample.run for sample in reader.samples()] == [*range(1, 401)]
        assert tracemalloc.get_traced_memory()[1] < 2**24
    finally:
        tracemalloc.stop()
