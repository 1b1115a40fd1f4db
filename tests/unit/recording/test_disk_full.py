"""A full disk ends the recording properly: the file is closed, valid, and the session is told."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import Any

import pytest

from shared.clock import SystemClock
from shared.errors import UserError
from shared.memory_bus import MemoryBus
from station.recording import disk, writer
from station.recording.mcap_file import McapFile
from station.recording.reader import open_recording
from station.recording.recorder import Recorder
from station.recording.repair import repair_folder
from station.recording.writer import Recording, partial_path
from tests.unit.recording import session


class SmallDisk:
    """Room for `room` bytes; more when the reserve is given up."""

    def __init__(self, room: int) -> None:
        self.room = room

    def limit(self, file: disk.ReservedFile) -> None:
        """Makes a file's writes end, at first short and then with ENOSPC, where the room does."""
        raw: Any = file._file  # pyright: ignore[reportPrivateUsage]
        file._file = _LimitedFile(raw, self)  # type: ignore[assignment]  # pyright: ignore


class _LimitedFile:
    def __init__(self, raw: Any, small: SmallDisk) -> None:
        self._raw = raw
        self._disk = small

    def write(self, data: memoryview) -> int:
        if self._disk.room <= 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        written = self._raw.write(data[: self._disk.room])
        self._disk.room -= written
        return written

    def __getattr__(self, name: str) -> Any:
        return getattr(self._raw, name)


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> SmallDisk:
    small = SmallDisk(room=30_000)
    keep_back, drop = disk.ReservedFile._keep_back, disk.ReservedFile._drop_reserve  # pyright: ignore

    def opened(self: disk.ReservedFile, size: int) -> None:
        keep_back(self, size)
        small.limit(self)

    def dropped(self: disk.ReservedFile) -> bool:
        given = drop(self)
        small.room += disk.RESERVE_BYTES * given
        return given

    monkeypatch.setattr(disk.ReservedFile, "_keep_back", opened)
    monkeypatch.setattr(disk.ReservedFile, "_drop_reserve", dropped)
    return small


def test_the_file_is_closed_and_valid(tmp_path: Path, small: SmallDisk) -> None:
    told: list[str] = []
    path = tmp_path / "a.mcap"
    recording = Recording(path, provenance=session.provenance(), on_stopped=told.append)
    sent = 0
    for receive_ns, topic, message in session.traffic():
        recording.write_message(topic, message, receive_ns=receive_ns)
        sent += not recording.refused
    recording.close()
    assert len(told) == 1
    assert "the disk is full" in told[0]
    assert recording.refused > 0
    # Nothing that was taken is lost: the chunk that met the full disk went into the reserve.
    assert len(list(open_recording(path).messages(truth=True))) == sent > 0
    assert sorted(item.name for item in tmp_path.iterdir()) == ["a.mcap"]


def test_the_recorder_tells_the_session(tmp_path: Path, small: SmallDisk) -> None:
    clock = SystemClock()
    bus = MemoryBus(clock)
    told: list[str] = []
    recording = Recording(tmp_path / "a.mcap", provenance=session.provenance(), flush_every_s=0.0)
    recorder = Recorder(bus, recording, clock=clock, on_stopped=told.append)
    for _, topic, message in session.traffic():
        bus.publish(topic, message)
    counts = recorder.close()
    assert len(told) == 1
    assert sum(counts.recorded.values()) + sum(counts.dropped.values()) == len(list(session.traffic()))
    assert sum(counts.dropped.values()) > 0
    assert open_recording(tmp_path / "a.mcap").topics["camera/corners"].count > 0


def test_when_even_the_reserve_is_gone_the_partial_file_stays(tmp_path: Path, small: SmallDisk) -> None:
    told: list[str] = []
    path = tmp_path / "a.mcap"
    recording = Recording(path, provenance=session.provenance(), on_stopped=told.append)
    small.room = -disk.RESERVE_BYTES
    for receive_ns, topic, message in session.traffic():
        recording.write_message(topic, message, receive_ns=receive_ns)
    recording.close()
    assert len(told) == 1
    assert "station repair" in told[0]
    assert partial_path(path).exists()


@pytest.mark.parametrize("both", [False, True])
def test_at_a_seam_the_file_that_broke_off_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, both: bool
) -> None:
    """It named the next part, which is empty."""
    finish, left = McapFile.finish, [2 if both else 1]

    def no_room_at_first(self: McapFile) -> None:
        if left[0]:
            left[0] -= 1
            raise OSError(errno.ENOSPC, "No space left on device")
        finish(self)

    monkeypatch.setattr(McapFile, "finish", no_room_at_first)
    told, path = list[str](), tmp_path / "a.mcap"
    recording = Recording(
        path, provenance=session.provenance(), flush_every_s=0.02, split_bytes=20_000, on_stopped=told.append
    )
    sent = 0
    for receive_ns, topic, message in session.traffic():
        recording.write_message(topic, message, receive_ns=receive_ns)
        sent += not recording.refused
    recording.close()
    broken = [partial_path(path), *([partial_path(tmp_path / "a.part002.mcap")] if both else [])]
    assert [sentence.count(str(file)) for sentence in told for file in broken] == [2] * len(broken)
    assert told[0].count("station repair") == len(broken)
    assert [done.source for done in repair_folder(tmp_path)] == broken
    assert sum(1 for _ in open_recording(path).messages(truth=True)) == sent > 0


def test_a_part_that_cannot_be_described_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.mcap"
    recording = Recording(path, provenance=session.provenance(), flush_every_s=0.02, split_bytes=20_000)

    def no_room(_file: McapFile, *_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(McapFile, "add_attachment", no_room)
    with recording:
        for receive_ns, topic, message in session.traffic():
            recording.write_message(topic, message, receive_ns=receive_ns)
    assert [file.name for file in tmp_path.iterdir()] == ["a.mcap"]
    assert not open_recording(path).miscounted


def test_it_stops_before_the_disk_is_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:

    def nearly_nothing(folder: Path) -> int:
        return 1000

    told: list[str] = []
    path = tmp_path / "a.mcap"
    recording = Recording(path, provenance=session.provenance(), on_stopped=told.append)
    monkeypatch.setattr(writer, "free_bytes", nearly_nothing)
    for receive_ns, topic, message in session.traffic():
        recording.write_message(topic, message, receive_ns=receive_ns)
    assert len(told) == 1
    assert open_recording(path).duration_s == pytest.approx(writer.FLUSH_EVERY_S, abs=0.02)


def test_a_nearly_full_disk_is_refused_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:

    def little(folder: Path) -> int:
        return writer.MIN_FREE_BYTES

    monkeypatch.setattr(writer, "free_bytes", little)
    with pytest.raises(UserError, match=r"at least 71 MB .* got 67 MB"):
        Recording(tmp_path / "a.mcap", provenance=session.provenance())
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot be written"):
        Recording(tmp_path / "none" / "none" / "a.mcap", provenance=session.provenance())


def test_a_missing_folder_is_made(tmp_path: Path) -> None:
    Recording(tmp_path / "recordings" / "a.mcap", provenance=session.provenance()).close()
    assert (tmp_path / "recordings" / "a.mcap").is_file()
