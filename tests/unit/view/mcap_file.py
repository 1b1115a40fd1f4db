"""Writes the made-up session to an MCAP with the plain library."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from mcap.writer import CompressionType, Writer

from shared import wire
from tests.unit.view.session import Item


def write_mcap(path: Path, items: Iterable[Item], *, latency_ns: int = 2_000_000) -> Path:
    """One MCAP as recordings are: protobuf, chunked, publish time = capture, log time = receipt."""
    channels: dict[str, int] = {}
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=1 << 20, compression=CompressionType.LZ4)
        writer.start(profile="", library="test")
        for topic, message, publish_ns in items:
            if topic not in channels:
                schema = writer.register_schema(
                    name=wire.schema_name(type(message)), encoding="protobuf", data=wire.schema(type(message))
                )
                channels[topic] = writer.register_channel("/" + topic, "protobuf", schema)
            writer.add_message(
                channels[topic], log_time=publish_ns + latency_ns, publish_time=publish_ns, data=wire.encode(message)
            )
        writer.finish()
    return path
