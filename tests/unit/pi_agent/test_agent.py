"""The agent with its threads, on a bus within the process."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import sys
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from pi_agent.agent import Agent
from pi_agent.calibration.model import Calibration, nominal
from pi_agent.cameras import Camera, CameraContext, load_camera
from pi_agent.synthetic_view import SyntheticOptions, SyntheticView
from shared.bus import Received
from shared.clock import SystemClock
from shared.errors import UserError
from shared.memory_bus import MemoryBus
from shared.messages import ClockPing, ClockPong, FrameReply, FrameRequest, Message
from shared.rig import MarkConfig, RigConfig
from tests.patience import PATIENCE_S
from tests.unit.pi_agent import fake_picamera2
from tests.unit.pi_agent.rigs import FakeTwin, ScriptedCamera, rig, scene

"""How long what must happen is waited for; an emulated processor is some tens of times slower."""


class Listener:
    """Keeps what comes over the bus, by topic."""

    def __init__(self, bus: MemoryBus) -> None:
        self.messages: dict[str, list[Any]] = defaultdict(list)
        bus.subscribe("**", self._keep)

    def _keep(self, received: Received) -> None:
        self.messages[received.topic].append(received.message)

    def __getitem__(self, topic: str) -> list[Any]:
        return self.messages[topic]

    @property
    def log(self) -> str:
        return "\n".join(line.message for line in self["log"])

    def wait(self, happened: Callable[[], bool]) -> None:
        give_up = time.monotonic() + PATIENCE_S
        while not happened():
            assert time.monotonic() < give_up, f"it did not come to pass; the log says: {self.log}"
            time.sleep(0.01)


@contextlib.contextmanager
def running(
    config: RigConfig, camera: Camera, bus: MemoryBus, calibration: Calibration | None = None
) -> Generator[Agent]:
    agent, stop = Agent(config, camera, bus, SystemClock(), calibration=calibration), threading.Event()
    thread = threading.Thread(target=agent.run, args=(stop,))
    thread.start()
    try:
        yield agent
    finally:
        stop.set()
        thread.join(timeout=10)
        assert not thread.is_alive()


def images(count: int) -> list[Any]:
    view = SyntheticView(rig(), rng=np.random.default_rng(1))
    return [view.frame(scene(), 0) for _ in range(count)]


def test_everything_that_the_agent_says_comes_over_the_bus():
    config, clock = rig(), SystemClock()
    bus = MemoryBus(clock)
    heard = Listener(bus)
    camera = load_camera(CameraContext(rig=config, bus=bus, clock=clock))
    with FakeTwin(bus, clock), running(config, camera, bus) as agent:
        heard.wait(lambda: len(heard["camera/corners"]) > 60 and len(heard["camera/status"]) > 1)
        heard.wait(lambda: len(heard["camera/image"]) > 3 and len(heard["camera/plate"]) > 8)
        heard.wait(lambda: bool(heard["camera/geometry"] and heard["camera/calibration"]))
        assert "camera" in bus.alive()
    corners = heard["camera/corners"]
    assert all(report.found for report in corners)
    assert {report.boot_id for report in corners} == {agent.boot_id}
    assert all(a.seq < b.seq and a.capture_ns < b.capture_ns for a, b in itertools.pairwise(corners))
    status = heard["camera/status"][-1]
    assert (status.fault, status.exposure_ns, status.boot_id) == ("", 2_000_000, agent.boot_id)
    assert status.frames > 0
    assert len(heard["camera/image/overlay"]) == len(heard["camera/image"])
    assert "synthetic camera: 600 x 600 at 90.00 Hz, global shutter" in heard.log


def test_the_clock_and_full_frames_are_served():
    config, clock = rig(preview_hz=0.0), SystemClock()
    bus = MemoryBus(clock)
    heard = Listener(bus)
    camera = load_camera(CameraContext(rig=config, bus=bus, clock=clock))
    replies: list[Message | None] = []
    with FakeTwin(bus, clock), running(config, camera, bus):
        heard.wait(lambda: len(heard["camera/corners"]) > 10)
        before = clock.now_ns()
        bus.request("camera/clock", ClockPing(station_ns=5), replies.append)
        # Three frames that were seen, however long ago that was, and what comes.
        stretch = FrameRequest(from_ns=heard["camera/corners"][-3].capture_ns, to_ns=before + 50_000_000)
        bus.request("camera/frames", stretch, replies.append)
        heard.wait(lambda: len(heard["camera/image"]) > 2 and heard["camera/corners"][-1].capture_ns > stretch.to_ns)
    pong, reply = replies
    assert isinstance(pong, ClockPong)
    assert pong.station_ns == 5
    assert before <= pong.agent_ns <= clock.now_ns()
    assert isinstance(reply, FrameReply)
    assert reply.frames > 2
    stamps = [image.timestamp.ns for image in heard["camera/image"]]
    assert all(stretch.from_ns <= stamp <= stretch.to_ns for stamp in stamps)
    assert len(set(stamps)) == len(stamps)


def test_a_missing_twin_is_named_and_its_coming_mends_it():
    config, clock = rig(), SystemClock()
    bus = MemoryBus(clock)
    heard = Listener(bus)
    camera = load_camera(CameraContext(rig=config, bus=bus, clock=clock))
    with running(config, camera, bus):
        heard.wait(lambda: any("start `station twin`" in status.fault for status in heard["camera/status"]))
        assert heard["camera/corners"] == []
        with FakeTwin(bus, clock):
            heard.wait(lambda: len(heard["camera/corners"]) > 3)
            heard.wait(lambda: heard["camera/status"][-1].fault == "")
    assert heard.log.count("start `station twin`") == 1
    assert "Frames come again" in heard.log


@pytest.mark.parametrize("fault", [UserError("the cable is out"), RuntimeError("segment 3 failed")])
def test_a_camera_that_fails_is_opened_again_and_its_count_goes_on(fault: Exception):
    camera = ScriptedCamera([*images(3), fault, *images(3)])
    bus = MemoryBus(SystemClock())
    heard = Listener(bus)
    with running(rig(), camera, bus):
        heard.wait(lambda: len(heard["camera/corners"]) == 6)
        heard.wait(lambda: any(str(fault) in status.fault for status in heard["camera/status"]))
    assert [report.seq for report in heard["camera/corners"]] == list(range(6))
    assert camera.opened == camera.closed
    assert str(fault) in heard.log


def test_a_silent_camera_is_a_fault():
    bus = MemoryBus(SystemClock())
    heard = Listener(bus)
    with running(rig(), ScriptedCamera(images(2)), bus):
        heard.wait(lambda: any("No frame from the camera" in status.fault for status in heard["camera/status"]))


def test_a_wrong_format_is_a_fault():
    bus = MemoryBus(SystemClock())
    heard = Listener(bus)
    with running(rig(), ScriptedCamera([np.zeros((480, 640), np.uint8)]), bus):
        heard.wait(lambda: any("640 x 480" in status.fault for status in heard["camera/status"]))
    assert heard["camera/corners"] == []


def test_a_lower_rate_than_wanted_is_said():
    bus = MemoryBus(SystemClock())
    heard = Listener(bus)
    with running(rig(), ScriptedCamera(images(1), rate_hz=58.92), bus):
        heard.wait(lambda: bool(heard["camera/corners"]))
    assert "58.92 Hz where rate_hz asks for 90.00" in heard.log


def test_a_calibration_is_sent_and_recorded_with_its_name():
    measured = dataclasses.replace(
        nominal(rig(), width_px=600, height_px=600),
        source="calibration.toml",
        distortion=(-0.1, 0.0, 0.0, 0.0, 0.0),
        corner_sigma_px=0.017,
    )
    bus = MemoryBus(SystemClock())
    heard = Listener(bus)
    with running(rig(), ScriptedCamera(images(40)), bus, measured):
        heard.wait(lambda: bool(heard["camera/geometry"] and heard["camera/calibration"]))
    assert heard["camera/geometry"][0].source == "calibration.toml"
    assert heard["camera/geometry"][0].corner_sigma_px == 0.017
    assert measured.distortion == heard["camera/calibration"][0].D


def test_a_calibration_of_another_picture_is_a_fault():
    other = dataclasses.replace(nominal(rig(), width_px=640, height_px=480), source="old.toml")
    bus = MemoryBus(SystemClock())
    heard = Listener(bus)
    with running(rig(), ScriptedCamera(images(3)), bus, other):
        heard.wait(lambda: any("old.toml for 640 x 480" in status.fault for status in heard["camera/status"]))
    assert heard["camera/corners"] == []


@pytest.mark.parametrize(("light", "said"), [(0.001, "The picture is black"), (5.0, "The picture is saturated")])
def test_a_dark_or_bright_picture_is_said_and_its_mending_too(light: float, said: str):
    bad = SyntheticView(rig(), rng=np.random.default_rng(1), options=SyntheticOptions(light=light)).frame(scene(), 0)
    bus = MemoryBus(SystemClock())
    heard = Listener(bus)
    with running(rig(), ScriptedCamera([*[bad] * 120, *images(200)]), bus):
        heard.wait(lambda: any(said in status.fault for status in heard["camera/status"]))
        heard.wait(lambda: "found again" in heard.log)
        heard.wait(lambda: heard["camera/status"][-1].fault == "")
    assert heard.log.count(said) == 1


def test_two_markers_are_said():
    one = images(1)[0]
    two = one.copy()
    two[120:220, 120:220] = one[250:350, 250:350]
    bus = MemoryBus(SystemClock())
    heard = Listener(bus)
    with running(rig(), ScriptedCamera([two] * 120), bus):
        heard.wait(lambda: any("Two markers" in status.fault for status in heard["camera/status"]))


def test_a_marker_that_reaches_out_of_the_picture_is_said():
    out = SyntheticView(rig(), rng=np.random.default_rng(1)).frame(scene(0.0465), 0)
    bus = MemoryBus(SystemClock())
    heard = Listener(bus)
    with running(rig(), ScriptedCamera([out] * 120), bus):
        heard.wait(lambda: any(status.fault for status in heard["camera/status"]))
        heard.wait(lambda: "arker" in heard["camera/status"][-1].fault)
    assert not any(report.found for report in heard["camera/corners"])


def test_a_twin_by_another_clock_is_named():
    class Ahead(SystemClock):
        def now_ns(self) -> int:
            return super().now_ns() + 5_000_000_000

    config, clock = rig(), SystemClock()
    bus = MemoryBus(clock)
    heard = Listener(bus)
    camera = load_camera(CameraContext(rig=config, bus=bus, clock=clock))
    with FakeTwin(bus, Ahead()), running(config, camera, bus):
        heard.wait(lambda: any("stamped +5.0 s" in status.fault for status in heard["camera/status"]))


def test_a_garbage_video_is_said_and_a_good_one_in_its_place_is_played(tmp_path: Path):
    video = tmp_path / "v.avi"
    video.write_bytes(b"this is no video")
    clock = SystemClock()
    bus = MemoryBus(clock)
    heard = Listener(bus)
    config = rig(driver="video_file", options={"path": "v.avi", "loop": True})
    camera = load_camera(CameraContext(rig=config, bus=bus, clock=clock, folder=tmp_path))
    with running(config, camera, bus):
        heard.wait(lambda: any("cannot read" in status.fault for status in heard["camera/status"]))
        writer = cv2.VideoWriter(str(tmp_path / "good.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (600, 600))
        for image in images(10):
            writer.write(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
        writer.release()
        (tmp_path / "good.avi").rename(video)
        heard.wait(lambda: any(report.found for report in heard["camera/corners"]))
        heard.wait(lambda: heard["camera/status"][-1].fault == "")


def test_a_missing_library_is_said_and_its_coming_mends_it(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "picamera2", None)
    clock = SystemClock()
    bus = MemoryBus(clock)
    heard = Listener(bus)
    config = rig(driver="pi_camera")
    camera = load_camera(CameraContext(rig=config, bus=bus, clock=clock))
    with running(config, camera, bus):
        heard.wait(lambda: any("python3-picamera2" in status.fault for status in heard["camera/status"]))
        fake_picamera2.Picamera2.cable.set()
        monkeypatch.setattr(fake_picamera2.Picamera2, "attached", [fake_picamera2.OV9281])
        monkeypatch.setitem(sys.modules, "picamera2", fake_picamera2)
        heard.wait(lambda: len(heard["camera/corners"]) > 3)
        heard.wait(lambda: "python3-picamera2" not in heard["camera/status"][-1].fault)
    assert sum("python3-picamera2" in line for line in heard.log.splitlines()) == 1


@pytest.mark.parametrize(
    ("mark", "said"),
    [
        (MarkConfig(feature="tag", tag_dictionary="NOPE"), "an OpenCV dictionary of tags such as .*, got 'NOPE'"),
        (MarkConfig(feature="tag", tag_id=-5), "a tag of APRILTAG_16h5, which has 0 to 29, got -5"),
    ],
)
def test_a_tag_that_there_is_not_is_refused_at_the_start(mark: MarkConfig, said: str) -> None:
    """The agent opened its camera twice a second, and said so each time, without end."""
    clock = SystemClock()
    with pytest.raises(UserError, match=said):
        Agent(rig(mark=mark), ScriptedCamera([]), MemoryBus(clock), clock)


def test_a_block_as_high_as_the_measured_camera_is_refused_at_the_start() -> None:
    """The agent opened its camera twice a second, and said so each time, without end."""
    clock, config = SystemClock(), rig()
    size = {"width_px": config.camera.width_px, "height_px": config.camera.height_px}
    low = dataclasses.replace(nominal(config, **size), camera_m=(0.0, 0.0, config.block.size_m[2]))
    with pytest.raises(UserError, match="Expected a block lower than its camera"):
        Agent(config, ScriptedCamera([]), MemoryBus(clock), clock, calibration=low)
