"""A recording written by a process beside is the recording that this process would write."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shared import foxglove, frames
from shared.bus import Received, Recipe
from shared.errors import UserError
from shared.messages import MarkerCorners, Message, PlatformState
from station.recording import writer_process
from station.recording.reader import open_recording
from station.recording.writer import Recording, partial_path
from station.recording.writer_process import WriterProcess, can_start_writer_process
from tests.contracts.test_messages import CLASSES, messages, same
from tests.unit.recording import session

pytestmark = pytest.mark.skipif(not can_start_writer_process(), reason="needs Linux and two processors")
COUNT = 3 * writer_process.BATCH + 7


def received(number: int) -> Received:
    stamp_ns = session.START_NS + number * 1_000_000
    message: Message = MarkerCorners(stamp_ns, number, (0.5,) * 8, found=True)
    if number % 5 == 0:
        attitude, geometry = PlatformState(stamp_ns, qx=0.1 + 1e-6 * number), session.GEOMETRY
        sizes = {"pivot_above_plate_m": 0.005, "block_height_m": 0.01}
        heard = {"now_ns": stamp_ns, "attitude": attitude, "geometry": geometry, "corners": message}
        return Received("tf", receive_ns=stamp_ns, recipe=Recipe(frames.seen, heard | sizes))
    if number % 3 == 0:
        pose = foxglove.FrameTransform(foxglove.Timestamp.from_ns(stamp_ns), "world", "plate")
        return Received("tf", receive_ns=stamp_ns, message=foxglove.FrameTransforms((pose, pose)))
    return Received("camera/corners", receive_ns=stamp_ns, message=message)


def written(path: Path, *, apart: bool) -> bytes:
    recording = Recording(path, provenance=session.provenance(), flush_every_s=0.5)
    with WriterProcess(recording) if apart else recording as sink:
        for number in range(COUNT):
            sink.write(received(number))
    return path.read_bytes()


def test_the_file_is_the_same_byte_for_byte(tmp_path: Path) -> None:
    assert written(tmp_path / "apart.mcap", apart=True) == written(tmp_path / "within.mcap", apart=False)


@pytest.mark.parametrize("cls", CLASSES, ids=lambda cls: cls.__name__)
@settings(max_examples=30, deadline=None)
@given(data=st.data())
def test_every_message_crosses_as_it_is(cls: type[Message], data: st.DataObject) -> None:
    message = data.draw(messages(cls))
    values = writer_process._reader(cls)(message)  # pyright: ignore[reportPrivateUsage]
    assert same(writer_process._maker(cls)(values), message)  # pyright: ignore[reportPrivateUsage]


def test_a_full_disk_is_told(tmp_path: Path) -> None:
    path = tmp_path / "full.mcap"
    recording = Recording(path, provenance=session.provenance(), flush_every_s=0.1)
    recording._min_free_bytes = 1 << 62  # pyright: ignore[reportPrivateUsage]
    sink = WriterProcess(recording)
    for number in range(COUNT):
        sink.write(received(number))
    sink.close()
    assert "the disk is full" in sink.stopped
    assert open_recording(path).topics


def test_a_writer_that_dies_is_named(tmp_path: Path) -> None:
    recording = Recording(tmp_path / "dead.mcap", provenance=session.provenance())
    sink = WriterProcess(recording)
    pid = sink._process.pid  # pyright: ignore[reportPrivateUsage]
    assert pid is not None
    os.kill(pid, signal.SIGKILL)
    sink._process.join()  # pyright: ignore[reportPrivateUsage]
    with pytest.raises(UserError, match=r"dead\.mcap ended by itself.*repair"):
        sink.close()


def test_what_was_sent_is_kept_when_the_session_dies(tmp_path: Path) -> None:
    path = tmp_path / "orphan.mcap"
    child = os.fork()
    if child == 0:
        sink = WriterProcess(Recording(path, provenance=session.provenance()))
        for number in range(writer_process.BATCH):
            sink.write(received(number))
        os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(child, 0)
    wait_for(path)
    assert sum(1 for _ in open_recording(path).messages()) == writer_process.BATCH
    assert not partial_path(path).exists()


def wait_for(path: Path) -> None:
    end = time.monotonic() + 30.0
    while not path.exists() and time.monotonic() < end:
        time.sleep(0.01)
