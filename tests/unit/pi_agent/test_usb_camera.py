"""The USB camera's driver on a virtual live source: a motion-JPEG stream."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

from pi_agent.cameras import Camera, CameraContext, Frame, load_camera
from pi_agent.cameras.usb_camera import grey
from shared.clock import SystemClock
from shared.errors import UserError
from shared.memory_bus import MemoryBus
from tests.unit.pi_agent.rigs import rig
from tests.unit.pi_agent.stream import StreamCamera


def camera(**options: Any) -> Camera:
    clock = SystemClock()
    setting = rig(driver="usb_camera", options=options)
    return load_camera(CameraContext(rig=setting, bus=MemoryBus(clock), clock=clock))


def read(source: Camera) -> Frame:
    frame = source.read(5.0)
    assert frame is not None
    return frame


def test_the_rate_is_measured_and_not_believed():
    with StreamCamera(rate_hz=10.0) as stream:  # no faster than a busy machine can send and read
        source = camera(device=stream.address)
        info = source.open()  # the rig file asks for 90 Hz
        source.close()
    assert info.rate_hz == pytest.approx(10.0, rel=0.1)
    assert info.shutter == "unknown"


def test_frames_come_in_order_and_the_newest_first():
    with StreamCamera(rate_hz=60.0) as stream:
        source = camera(device=stream.address)
        source.open()
        first = read(source)
        time.sleep(0.3)
        late = read(source)
        source.close()
    passed = late.seq - first.seq
    assert passed > 5
    assert (int(late.image[0, 0]) - int(first.image[0, 0])) % 200 == pytest.approx(passed, abs=2)
    assert late.dropped - first.dropped == passed - 1


def test_an_unplugged_camera_is_named():
    with StreamCamera() as stream:
        source = camera(device=stream.address)
        source.open()
        read(source)
        stream.unplugged.set()
        with pytest.raises(UserError, match="unplugged"):
            [source.read(1.0) for _ in range(100)]
        source.close()


def test_a_missing_device_is_named():
    with pytest.raises(UserError, match="/dev/video99"):
        camera(device="/dev/video99").open()


def test_another_size_than_wanted_is_named():
    with StreamCamera(size=(640, 480)) as stream:
        source = camera(device=stream.address)
        with pytest.raises(UserError, match="got 640 x 480"):
            source.open()


@pytest.mark.parametrize("options", [{"shutter": "rolling"}, {"tone": "film"}, {"pixel_format": "RGB"}])
def test_options_that_contradict_themselves_are_refused(options: dict[str, Any]):
    with pytest.raises(UserError, match=next(iter(options)) + "|row_time"):
        camera(**options)


def test_luminance_is_taken_from_whatever_was_retrieved():
    plane = np.arange(12, dtype=np.uint8).reshape(3, 4)
    assert np.array_equal(grey(plane), plane)
    assert np.array_equal(grey(np.stack([plane, 9 * np.ones_like(plane)], axis=-1)), plane)
    assert np.array_equal(grey(np.repeat(plane[:, :, None], 3, axis=2)), plane)
