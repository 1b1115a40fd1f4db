"""The recorder's thread loses nothing silently."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from shared import foxglove
from shared.bus import Missed, Received
from shared.clock import SystemClock
from shared.memory_bus import MemoryBus
from shared.messages import AngleReading, Heartbeat, MarkerCorners
from station.recording import writer
from station.recording.for_viewers import TOPICS as FOR_VIEWERS
from station.recording.reader import open_recording
from station.recording.recorder import Recorder
from station.recording.writer import Recording
from tests.patience import PATIENCE_S
from tests.unit.recording import session


def corners(seq: int) -> MarkerCorners:
    return MarkerCorners(seq=seq, capture_ns=session.START_NS + seq, corners_px=(1.0,) * 8, found=True)


def logged(path: Path) -> list[str]:
    items = (item.message for item in open_recording(path).messages({"log"}))
    return [message.message for message in items if isinstance(message, foxglove.Log)]


def test_every_topic_is_recorded_once(tmp_path: Path) -> None:
    clock = SystemClock()
    bus = MemoryBus(clock)
    path = tmp_path / "a.mcap"
    recorder = Recorder(bus, Recording(path, provenance=session.provenance()), clock=clock)
    for seq in range(500):
        bus.publish("camera/corners", corners(seq))
        bus.publish("angle/imu", AngleReading(stamp_ns=session.START_NS, source="imu", angle_rad=0.1))
        bus.publish("arm/newer", Heartbeat(stamp_ns=5, armed=True))
    counts = recorder.close()
    assert counts.recorded == {"camera/corners": 500, "angle/imu": 500, "arm/newer": 500}
    reader = open_recording(path)
    found = {name: info.count for name, info in reader.topics.items() if name not in FOR_VIEWERS}
    assert found == counts.recorded
    assert reader.topics["arm/newer"].schema == writer.UNKNOWN_SCHEMA
    seqs = [item.message.seq for item in reader.messages() if isinstance(item.message, MarkerCorners)]
    assert seqs == list(range(500))
    assert reader.metadata["recorder"]["dropped"] == "0"


def test_what_came_twice_is_counted(tmp_path: Path) -> None:
    clock = SystemClock()
    bus = MemoryBus(clock)
    recorder = Recorder(bus, Recording(tmp_path / "a.mcap", provenance=session.provenance()), clock=clock)
    bus.duplicates["camera/corners"] += 2
    assert recorder.close().duplicates == {"camera/corners": 2}
    assert open_recording(tmp_path / "a.mcap").metadata["recorder"]["duplicates camera/corners"] == "2"


class SlowRecording(Recording):
    """A recording on a disk that hangs until `go` is set."""

    go: threading.Event

    def write(self, received: Received) -> None:
        self.go.wait(timeout=PATIENCE_S)
        super().write(received)


def test_a_full_queue_drops_images_first_and_says_so(tmp_path: Path) -> None:
    clock = SystemClock()
    bus = MemoryBus(clock)
    path = tmp_path / "a.mcap"
    recording = SlowRecording(path, provenance=session.provenance())
    recording.go = threading.Event()
    recorder = Recorder(bus, recording, clock=clock, capacity=100)
    for seq in range(50):
        bus.publish("camera/corners", corners(seq))
        bus.publish("camera/image", foxglove.CompressedImage(data=b"x"))
    for seq in range(50, 150):
        bus.publish("camera/corners", corners(seq))
    recording.go.set()
    counts = recorder.close()
    assert counts.dropped["camera/image"] > 40
    assert 40 < counts.dropped["camera/corners"] < 60
    assert sum(counts.recorded.values()) + sum(counts.dropped.values()) == 200
    reader = open_recording(path)
    assert reader.metadata["recorder"]["dropped camera/corners"] == str(counts.dropped["camera/corners"])
    lines = logged(path)
    assert any(f"{counts.dropped['camera/corners']} messages of camera/corners were dropped" in line for line in lines)


class LossyBus(MemoryBus):
    """A bus that reports a loss when asked to."""

    def subscribe(self, topic, handler, *, direct=False, on_miss=None):  # pyright: ignore
        super().subscribe(topic, handler, direct=direct, on_miss=on_miss)  # pyright: ignore[reportUnknownArgumentType]
        if topic == "camera/corners":
            self.on_miss = on_miss  # pyright: ignore[reportUnknownMemberType]


def test_a_miss_is_recorded(tmp_path: Path) -> None:
    clock = SystemClock()
    bus = LossyBus(clock)
    path = tmp_path / "a.mcap"
    recorder = Recorder(bus, Recording(path, provenance=session.provenance()), clock=clock)
    bus.on_miss(Missed("camera/corners", count=7, receive_ns=clock.now_ns()))  # pyright: ignore
    assert recorder.close().missed == {"camera/corners": 7}
    assert logged(path) == ["7 messages of camera/corners were lost on the bus and could not be recovered"]
    assert open_recording(path).metadata["recorder"]["missed camera/corners"] == "7"


def test_a_garbled_payload_that_a_recording_holds_is_left_out_and_counted(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with Recording(path, provenance=session.provenance()) as recording:
        recording.write(Received("camera/corners", receive_ns=session.START_NS, payload=b"\xff\xff\xff"))
    reader = open_recording(path)
    assert reader.topics["camera/corners"].count == 1
    assert not list(reader.messages())
    assert reader.malformed == {"camera/corners": 1}


def test_what_waits_is_flushed_even_when_nothing_comes(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    recording = Recording(path, provenance=session.provenance(), flush_every_s=0.25)
    recording.write_message("camera/corners", corners(0), receive_ns=session.START_NS)
    size = writer.partial_path(path).stat().st_size
    recording.flush_if_due(session.START_NS + 240_000_000)
    assert writer.partial_path(path).stat().st_size == size
    recording.flush_if_due(session.START_NS + 260_000_000)
    assert writer.partial_path(path).stat().st_size > size
    recording.close()


def test_an_error_in_the_thread_ends_the_session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SystemClock()
    bus = MemoryBus(clock)
    told: list[str] = []
    recording = Recording(tmp_path / "a.mcap", provenance=session.provenance())

    def fail(received: Received) -> None:
        raise RuntimeError("a bug")

    monkeypatch.setattr(recording, "write", fail)
    monkeypatch.setattr(threading, "excepthook", print)
    recorder = Recorder(bus, recording, clock=clock, on_stopped=told.append)
    bus.publish("camera/corners", corners(0))
    recorder.close()
    assert len(told) == 1
    assert "a bug" in told[0]
