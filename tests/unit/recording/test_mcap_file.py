"""Our thin writer lays out the very bytes that the mcap library would."""

from __future__ import annotations

import io

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer

from shared import wire
from shared.messages import MarkerCorners, PlatformState
from station.recording.mcap_file import McapFile

CHUNK_BYTES = 4096


def messages(seed: int) -> list[tuple[int, int, int, bytes]]:
    rng = np.random.default_rng(seed)
    rows: list[tuple[int, int, int, bytes]] = []
    for index in range(400):
        # Receipt is not always in order on a live bus, so neither is the log time.
        log_ns = 1_600_000_000_000_000_000 + index * 1_000_000 + int(rng.integers(-5_000_000, 5_000_000))
        rows.append((int(rng.integers(1, 3)), log_ns, log_ns - 1000, rng.bytes(int(rng.integers(0, 300)))))
    return rows


def by_library(rows: list[tuple[int, int, int, bytes]], compression: str) -> bytes:
    stream = io.BytesIO()
    kind = {"lz4": CompressionType.LZ4, "zstd": CompressionType.ZSTD, "": CompressionType.NONE}[compression]
    writer = Writer(stream, chunk_size=CHUNK_BYTES, compression=kind)
    writer.start(profile="", library="x")
    writer.add_metadata("session", {"seed": "7"})
    writer.add_attachment(5, 5, "rig.toml", "text/plain", b"id")
    for cls, topic in ((MarkerCorners, "/a"), (PlatformState, "/b")):
        schema = writer.register_schema(wire.schema_name(cls), "protobuf", wire.schema(cls))
        writer.register_channel(topic, "protobuf", schema)
    for sequence, (channel, log_ns, publish_ns, payload) in enumerate(rows):
        writer.add_message(channel, log_ns, payload, publish_ns, sequence)
        if sequence % 150 == 0:
            writer.flush()
    writer.add_metadata("recorder", {"dropped": "0"})
    writer.finish()
    return stream.getvalue()


def by_us(rows: list[tuple[int, int, int, bytes]], compression: str) -> bytes:
    stream = io.BytesIO()
    file = McapFile(stream, library="x", compression=compression, chunk_bytes=CHUNK_BYTES)
    file.add_metadata("session", {"seed": "7"})
    file.add_attachment("rig.toml", b"id", media_type="text/plain", stamp_ns=5)
    for cls, topic in ((MarkerCorners, "/a"), (PlatformState, "/b")):
        file.register_channel(topic, schema_id=file.register_schema(wire.schema_name(cls), wire.schema(cls)))
    for sequence, (channel, log_ns, publish_ns, payload) in enumerate(rows):
        file.add_message(channel, log_ns=log_ns, publish_ns=publish_ns, sequence=sequence, payload=payload)
        if sequence % 150 == 0:
            file.flush()
    file.add_metadata("recorder", {"dropped": "0"})
    file.finish()
    return stream.getvalue()


@pytest.mark.parametrize("compression", ["lz4", "zstd", ""])
@pytest.mark.parametrize("seed", [1, 2])
def test_bytes_equal_the_librarys(compression: str, seed: int) -> None:
    rows = messages(seed)
    assert by_us(rows, compression) == by_library(rows, compression)


def test_an_empty_file_equals_the_librarys() -> None:
    assert by_us([], "lz4") == by_library([], "lz4")
