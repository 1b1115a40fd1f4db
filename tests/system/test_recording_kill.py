"""kill -9 of the recording process at any moment: at most half a second is missing."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from shared.clock import SystemClock
from shared.messages import MarkerCorners
from shared.zenoh_bus import ZenohBus
from station.recording.provenance import Provenance
from station.recording.reader import open_recording
from station.recording.recorder import Recorder
from station.recording.repair import repair_folder
from station.recording.writer import Recording, partial_path
from tests.patience import PATIENCE_S

pytestmark = pytest.mark.system
ROOT = Path(__file__).parents[2]
RIG = "recording-test"
FRAME_S = 1 / 90


def free_endpoint() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


class Camera(threading.Thread):
    """Publishes a numbered frame 90 times a second and remembers when it sent each."""

    def __init__(self, bus: ZenohBus) -> None:
        super().__init__(daemon=True)
        self._bus = bus
        self._clock = SystemClock()
        self._end = threading.Event()
        self.sent: list[int] = []

    def run(self) -> None:
        while not self._end.wait(FRAME_S):
            now_ns = self._clock.now_ns()
            corners = MarkerCorners(capture_ns=now_ns, seq=len(self.sent), boot_id=3, corners_px=(1.0,) * 8, found=True)
            self._bus.publish("camera/corners", corners)
            self.sent.append(now_ns)

    def stop(self) -> None:
        self._end.set()
        self.join()


@contextmanager
def camera() -> Generator[tuple[Camera, str]]:
    endpoint = free_endpoint()
    with ZenohBus(RIG, listen=[endpoint]) as bus:
        thread = Camera(bus)
        thread.start()
        try:
            yield thread, endpoint
        finally:
            thread.stop()


def start_recording(path: Path, endpoint: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "tests.system.test_recording_kill", str(path), endpoint]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stdin=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "recording\n"
    return process


def end(process: subprocess.Popen[str], how: signal.Signals) -> None:
    process.send_signal(how)
    process.communicate(timeout=PATIENCE_S)


def seqs(path: Path) -> list[int]:
    messages = (item.message for item in open_recording(path).messages({"camera/corners"}))
    return [message.seq for message in messages if isinstance(message, MarkerCorners)]


def test_killed_at_random_moments(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    kills = 6
    with camera() as (thread, endpoint):
        for kill in range(kills):
            path = tmp_path / f"{kill}.mcap"
            process = start_recording(path, endpoint)
            time.sleep(float(rng.uniform(0.6, 1.4)))
            killed_at = len(thread.sent)
            end(process, signal.SIGKILL)
            (done,) = repair_folder(tmp_path)
            assert done.path == path
            found = seqs(path)
            assert found == list(range(found[0], found[-1] + 1)), "a gap before the end"
            missing_s = (thread.sent[killed_at - 1] - thread.sent[found[-1]]) * 1e-9
            assert missing_s <= 0.5, f"kill {kill} lost {missing_s:.3f} s"
            reader = open_recording(path)
            assert reader.metadata["session"]["rig_id"] == RIG
            assert reader.attachments["rig.toml"] == b"id"


def test_a_restarted_recorder_goes_on_without_gap_or_repetition(tmp_path: Path) -> None:
    with camera() as (thread, endpoint):
        first = start_recording(tmp_path / "first.mcap", endpoint)
        time.sleep(1.0)
        end(first, signal.SIGKILL)
        repair_folder(tmp_path)
        second = start_recording(tmp_path / "second.mcap", endpoint)
        time.sleep(1.0)
        thread.stop()
        time.sleep(0.7)
        end(second, signal.SIGTERM)
    found = seqs(tmp_path / "second.mcap")
    # The cache gives what was published before the restart, together with what comes live: each frame once.
    assert found == list(range(found[0], len(thread.sent)))
    assert open_recording(tmp_path / "second.mcap").metadata["recorder"]["missed"] == "0"
    assert not partial_path(tmp_path / "second.mcap").exists()


def record_until_ended(path: Path, endpoint: str) -> None:
    """The process that is killed: a recorder on a real bus, closed properly by SIGTERM only."""
    ended = threading.Event()

    def end_properly(number: int, frame: object) -> None:
        ended.set()

    signal.signal(signal.SIGTERM, end_properly)
    clock = SystemClock()
    provenance = Provenance(rig_id=RIG, started_ns=clock.now_ns(), rig_toml="id")
    with ZenohBus(RIG, connect=[endpoint], clock=clock) as bus:
        recorder = Recorder(bus, Recording(path, provenance=provenance), clock=clock)
        print("recording", flush=True)
        ended.wait()
        recorder.close()


if __name__ == "__main__":
    record_until_ended(Path(sys.argv[1]), sys.argv[2])
