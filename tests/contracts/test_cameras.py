"""Every camera keeps its promises to the agent, whichever driver it is; a new driver needs a bench here."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import sys
import time
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from pi_agent.cameras import Camera, CameraContext, Frame, camera_names, load_camera
from shared.clock import SystemClock
from shared.errors import UserError
from shared.memory_bus import MemoryBus
from tests.patience import PATIENCE_S
from tests.unit.pi_agent import fake_picamera2
from tests.unit.pi_agent.rigs import FakeTwin, rig
from tests.unit.pi_agent.stream import StreamCamera

Bench = Callable[[Path], contextlib.AbstractContextManager[Camera]]


def context(folder: Path, driver: str, options: dict[str, Any] | None = None) -> CameraContext:
    clock = SystemClock()
    return CameraContext(rig=rig(driver=driver, options=options), bus=MemoryBus(clock), clock=clock, folder=folder)


@contextlib.contextmanager
def synthetic(folder: Path) -> Generator[Camera]:
    setting = context(folder, "synthetic")
    with FakeTwin(setting.bus, setting.clock):
        yield load_camera(setting)


@contextlib.contextmanager
def video_file(folder: Path) -> Generator[Camera]:
    cv2.imwrite(str(folder / "0.png"), np.zeros((60, 80), np.uint8))
    cv2.imwrite(str(folder / "1.png"), np.full((60, 80), 200, np.uint8))
    yield load_camera(context(folder, "video_file", {"path": ".", "loop": True}))


@contextlib.contextmanager
def pi_camera(folder: Path) -> Generator[Camera]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "picamera2", fake_picamera2)
        fake_picamera2.Picamera2.cable.set()
        fake_picamera2.Picamera2.attached = [fake_picamera2.OV9281]
        yield load_camera(context(folder, "pi_camera"))


@contextlib.contextmanager
def usb_camera(folder: Path) -> Generator[Camera]:
    with StreamCamera() as stream:
        yield load_camera(context(folder, "usb_camera", {"device": stream.address}))


BENCHES: dict[str, Bench] = {
    "pi_camera": pi_camera,
    "synthetic": synthetic,
    "usb_camera": usb_camera,
    "video_file": video_file,
}


@pytest.fixture(params=camera_names())
def camera(request: pytest.FixtureRequest, tmp_path: Path) -> Generator[Camera]:
    assert request.param in BENCHES, f"the camera '{request.param}' needs a bench in {__file__}"
    with BENCHES[request.param](tmp_path) as source:
        yield source
        source.close()


def read(source: Camera) -> Frame:
    give_up = time.monotonic() + PATIENCE_S
    while time.monotonic() < give_up:
        if (frame := source.read(0.5)) is not None:
            return frame
    raise AssertionError("no frame came")


def test_what_it_says_is_what_it_gives(camera: Camera):
    info = camera.open()
    frame = read(camera)
    assert frame.image.shape == (info.height_px, info.width_px)
    assert frame.image.dtype == np.uint8
    assert info.rate_hz > 0
    assert info.name
    assert info.shutter in ("global", "rolling", "unknown")
    assert (info.line_ns > 0) == (info.shutter == "rolling")


def test_frames_are_numbered_and_stamped_by_the_agents_clock(camera: Camera):
    started = SystemClock().now_ns()
    camera.open()
    frames = [dataclasses.replace(read(camera), image=np.zeros((1, 1), np.uint8)) for _ in range(5)]
    ended = SystemClock().now_ns()
    assert all(b.seq > a.seq and b.capture_ns > a.capture_ns for a, b in itertools.pairwise(frames))
    assert all(started - 10**8 <= frame.capture_ns <= ended + 10**8 for frame in frames)


def test_a_late_reader_gets_the_newest_frame_and_the_count_of_the_others(camera: Camera):
    rate_hz = camera.open().rate_hz
    late_s, far_apart = 12 / rate_hz, False
    # On a busy machine fewer frames than that may have been taken; the reader is later then.
    while not far_apart and late_s < PATIENCE_S:
        first = read(camera)
        time.sleep(late_s)
        second = read(camera)
        # None of them waits in a queue: what was missed is in the count and in the gap of the numbers alike.
        missed = second.dropped - first.dropped
        assert missed == second.seq - first.seq - 1
        far_apart = missed >= 5 and second.capture_ns - first.capture_ns > 5e9 / rate_hz
        late_s *= 2
    assert far_apart


def test_it_can_be_closed_and_opened_again(camera: Camera):
    camera.close()
    for _ in range(2):
        camera.open()
        read(camera)
        camera.close()


@pytest.mark.parametrize("name", camera_names())
def test_unknown_options_are_refused(name: str, tmp_path: Path):
    with pytest.raises(UserError, match="no_such_option"):
        load_camera(context(tmp_path, name, {"no_such_option": 1}))


def test_an_unknown_driver_is_named_with_those_that_exist(tmp_path: Path):
    with pytest.raises(UserError, match=r"synthetic.*got 'polaroid'"):
        load_camera(context(tmp_path, "polaroid"))
