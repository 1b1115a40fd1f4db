"""The writer keeps its promises to every other program that reads MCAP."""

from __future__ import annotations

from pathlib import Path

import pytest
from mcap.reader import make_reader

from shared import wire
from shared.clock import SIMULATION_EPOCH_NS, SimulatedClock
from shared.errors import UserError
from shared.memory_bus import MemoryBus
from shared.messages import ClockOffset, MarkerCorners, Sample
from station.recording.provenance import Provenance
from station.recording.recorder import record_within
from station.recording.writer import Recording, partial_path

START_NS = SIMULATION_EPOCH_NS


def provenance() -> Provenance:
    return Provenance(rig_id="bench", started_ns=START_NS, mode="lockstep", seed=7, rig_toml='id = "bench"\n')


def corners(seq: int, capture_ns: int) -> MarkerCorners:
    return MarkerCorners(capture_ns=capture_ns, seq=seq, corners_px=(1.0, 2.0) * 4, found=True, boot_id=5)


def test_what_is_published_is_read_back_by_the_mcap_library(tmp_path: Path) -> None:
    clock = SimulatedClock()
    bus = MemoryBus(clock)
    path = tmp_path / "a.mcap"
    with Recording(path, provenance=provenance()) as recording:
        record_within(bus, recording)
        assert partial_path(path).exists()
        for seq in range(100):
            clock.advance_to(START_NS + seq * 10_000_000)
            bus.publish("camera/corners", corners(seq, START_NS + seq * 10_000_000 - 3_000_000))
    assert not partial_path(path).exists()
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        rows = list(reader.iter_messages(topics=["/camera/corners"]))
        assert [record.sequence for _, _, record in rows] == list(range(100))
        schema, channel, record = rows[10]
        assert schema is not None
        assert (channel.topic, channel.message_encoding) == ("/camera/corners", "protobuf")
        assert (schema.name, schema.data) == ("repose.MarkerCorners", wire.schema(MarkerCorners))
        assert record.log_time - record.publish_time == 3_000_000
        assert wire.decode(MarkerCorners, record.data).seq == 10
        found = {item.name: item.metadata for item in reader.iter_metadata()}
        assert found["session"]["seed"] == "7"
        assert [item.data for item in reader.iter_attachments()] == [b'id = "bench"\n']


def test_publish_time_is_on_the_stations_clock(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with Recording(path, provenance=provenance()) as recording:
        offset = ClockOffset(stamp_ns=START_NS, agent="camera", offset_ns=1_000_000)
        recording.write_message("clock", offset, receive_ns=START_NS)
        recording.write_message("camera/corners", corners(0, START_NS), receive_ns=START_NS + 5_000_000)
        # A censored run was never detected: it happened when it was reported.
        recording.write_message("session/sample", Sample(censored=True), receive_ns=START_NS + 6_000_000)
    with path.open("rb") as file:
        times = {channel.topic: record.publish_time for _, channel, record in make_reader(file).iter_messages()}
    assert times["/camera/corners"] == START_NS + 1_000_000
    assert times["/session/sample"] == START_NS + 6_000_000


def test_an_existing_recording_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    Recording(path, provenance=provenance()).close()
    with pytest.raises(UserError, match="exists"):
        Recording(path, provenance=provenance())
    Recording(path, provenance=provenance(), overwrite=True).close()
