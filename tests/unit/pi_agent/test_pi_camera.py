"""The Pi's camera driver against the fake, and the fake against the real package's signatures."""

from __future__ import annotations

import importlib.util
import inspect
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pi_agent.cameras import Camera, CameraContext, Frame, load_camera
from pi_agent.tracking.tone import PI_DEFAULT
from shared.clock import SystemClock
from shared.errors import UserError
from shared.memory_bus import MemoryBus
from tests.unit.pi_agent import fake_picamera2, picamera2_api
from tests.unit.pi_agent.fake_picamera2 import IMX219, IMX296, IMX708, OV5647, OV9281, UNHEARD_OF, Picamera2, Sensor
from tests.unit.pi_agent.rigs import rig


@pytest.fixture(autouse=True)
def library(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setitem(sys.modules, "picamera2", fake_picamera2)
    Picamera2.cable.set()
    fake_picamera2.MappedArray.open_maps = 0
    yield
    Picamera2.attached = []


def camera(sensor: Sensor, *, options: dict[str, Any] | None = None, **config: Any) -> Camera:
    Picamera2.attached = [sensor]
    clock = SystemClock()
    setting = rig(driver="pi_camera", options=options, **config)
    return load_camera(CameraContext(rig=setting, bus=MemoryBus(clock), clock=clock))


def read(source: Camera) -> Frame:
    frame = source.read(5.0)
    assert frame is not None
    return frame


@pytest.mark.parametrize(
    ("sensor", "size", "rate", "shutter"),
    [
        (OV9281, (1280, 800), 90.0, "global"),
        (IMX219, (640, 480), 90.0, "rolling"),
        (IMX708, (1536, 864), 90.0, "rolling"),
        (OV5647, (640, 480), 58.92, "rolling"),
        (IMX296, (1456, 1088), 60.38, "global"),
    ],
)
def test_the_best_mode_is_taken_and_the_true_rate_said(sensor: Sensor, size: Any, rate: float, shutter: str):
    size_px = (480, 480) if sensor in (IMX219, OV5647) else (600, 600)
    source = camera(sensor, width_px=size_px[0], height_px=size_px[1])
    info = source.open()
    mode = Picamera2.last.stream_configuration("raw")["size"]
    source.close()
    assert mode == size
    assert info.rate_hz == pytest.approx(rate, rel=2e-3)
    assert info.shutter == shutter
    assert (info.width_px, info.height_px) == size_px
    assert f"mode {size[0]} x {size[1]}" in info.details


def test_a_slow_rate_takes_the_whole_field():
    source = camera(IMX219, width_px=480, height_px=480, rate_hz=40.0)
    info = source.open()
    source.close()
    assert Picamera2.last.stream_configuration("raw")["size"] == (1640, 1232)
    assert info.rate_hz == pytest.approx(40.0, rel=1e-3)


def test_rows_are_timed_by_the_sensor_and_its_crop():
    source = camera(IMX219, width_px=480, height_px=480)
    info = source.open()
    source.close()
    # The picture's 480 rows are the mode's 480, read out at 9.452 µs each (line length 3448 at 2 x 182.4 MHz).
    assert info.line_ns == pytest.approx(9452, rel=1e-3)
    small = camera(IMX219, options={"crop_px": [1400, 992, 480, 480]}, width_px=480, height_px=480)
    assert small.open().line_ns == pytest.approx(9452 / 2, rel=1e-3)  # half the rows, blown up to 480
    small.close()


@pytest.mark.parametrize(("sensor", "side_px", "line_ns"), [(OV9281, 600, 0.0), (IMX219, 480, 9452.0)])
def test_the_capture_time_is_the_middle_of_the_exposure_of_the_middle_row(
    monkeypatch: pytest.MonkeyPatch, sensor: Sensor, side_px: int, line_ns: float
):
    source = camera(sensor, width_px=side_px, height_px=side_px, exposure_ms=3.0)
    info = source.open()
    stamps: list[int] = []
    original = fake_picamera2.CompletedRequest.get_metadata

    def spy(request: fake_picamera2.CompletedRequest) -> dict[str, Any]:
        metadata = original(request)
        stamps.append(metadata["SensorTimestamp"])
        return metadata

    monkeypatch.setattr(fake_picamera2.CompletedRequest, "get_metadata", spy)
    frame = read(source)
    source.close()
    epoch_ns = SystemClock().from_monotonic_ns(0)
    # The stamp is when the first row's readout begins, and with it that row's exposure ends.
    first_row_ns = frame.capture_ns + 1e9 * float(info.row_times.dt_s(0.0))
    assert first_row_ns - stamps[-1] - epoch_ns == pytest.approx(-frame.exposure_ns / 2, abs=2e5)
    assert 1e9 * float(info.row_times.dt_s(side_px - 1.0) - info.row_times.dt_s(0.0)) == pytest.approx(
        line_ns * (side_px - 1), rel=1e-3
    )
    assert frame.exposure_ns == pytest.approx(3e6, rel=0.01)


def test_the_picture_is_the_unpadded_luminance_in_the_cameras_own_memory():
    source = camera(OV9281)
    source.open()
    frame = read(source)
    assert frame.image.shape == (600, 600)
    assert len(np.unique(frame.image)) == 1
    assert frame.image.max() < 99  # 99 is what the padding holds
    assert not frame.image.flags.owndata
    assert frame.image.strides[0] == 640
    value = int(frame.image[0, 0])
    read(source)
    assert int(frame.image[0, 0]) != value  # valid until the next read, and then given back
    source.close()


def test_no_buffer_is_kept():
    source = camera(OV9281)
    source.open()
    for _ in range(30):
        read(source)
    held = Picamera2.last
    assert fake_picamera2.MappedArray.open_maps == 1
    source.close()
    assert fake_picamera2.MappedArray.open_maps == 0
    assert held.lost == 0


def test_everything_automatic_is_off_and_the_tone_curve_is_straight():
    source = camera(IMX708, exposure_ms=1.5, gain=2.0, options={"lens_position": 4.0})
    info = source.open()
    held = Picamera2.last
    source.close()
    controls = held.controls
    assert controls["AeEnable"] is False
    assert controls["AwbEnable"] is False
    assert controls["ExposureTime"] == 1500
    assert controls["AnalogueGain"] == 2.0
    assert (controls["Sharpness"], controls["NoiseReductionMode"], controls["AfMode"]) == (0.0, 0, 0)
    assert controls["LensPosition"] == 4.0
    assert controls["FrameDurationLimits"] == (11111, 11111)
    contrast = Picamera2.find_tuning_algo(held.tuning, "rpi.contrast")
    assert contrast == {"ce_enable": 0, "gamma_curve": [0, 0, 65535, 65535]}
    assert info.tone.is_linear
    assert info.exposure_ns == pytest.approx(1.5e6, rel=0.01)  # not that of the first frames, which were 8 ms
    assert info.gain == 2.0


def test_without_a_tuning_file_the_default_curve_is_said():
    source = camera(Sensor("ov9281", OV9281.modes, has_tuning=False))
    assert source.open().tone == PI_DEFAULT
    source.close()


def test_an_unknown_rolling_shutter_is_said_and_can_be_told():
    source = camera(UNHEARD_OF)
    info = source.open()
    source.close()
    assert (info.shutter, info.line_ns) == ("unknown", 0.0)
    assert "row_time_us" in info.details
    told = camera(UNHEARD_OF, options={"row_time_us": 10.0})
    info = told.open()
    told.close()
    assert (info.shutter, info.line_ns) == ("rolling", pytest.approx(1e4 * 960 / 600))


def test_a_pulled_cable_is_survived_without_losing_a_buffer():
    source = camera(OV9281)
    source.open()
    read(source)
    Picamera2.cable.clear()
    time.sleep(0.03)
    while source.read(0.05) is not None:
        pass
    assert source.read(0.05) is None
    assert source.read(0.05) is None
    Picamera2.cable.set()
    frames = [read(source) for _ in range(10)]
    assert frames[-1].seq - frames[0].seq >= 9
    assert Picamera2.last.lost == 0
    source.close()


def test_lost_frames_are_counted_by_the_sensors_clock():
    source = camera(OV9281)
    source.open()
    first = read(source)
    Picamera2.cable.clear()
    time.sleep(0.2)
    Picamera2.cable.set()
    second = read(source)
    if second.seq == first.seq + 1:  # the one that was complete when the cable was pulled
        second = read(source)
    source.close()
    assert second.seq - first.seq > 10
    assert second.dropped > 9


@pytest.mark.parametrize(
    ("sensor", "config", "said"),
    [
        (Sensor("ov9281", OV9281.modes, busy=True), {}, "another program"),
        (Sensor("uvc", []), {}, "USB"),
        (OV9281, {"exposure_ms": 12.0}, "exposure_ms below 11.11"),
        (Sensor("ov9281", OV9281.modes, adjusted_size=(576, 600)), {}, "576 x 600"),
    ],
)
def test_what_cannot_work_is_said_in_one_sentence(sensor: Sensor, config: dict[str, Any], said: str):
    source = camera(sensor, **config)
    with pytest.raises(UserError, match=said):
        source.open()
    source.close()


def test_a_missing_camera_is_named():
    source = camera(OV9281)
    Picamera2.attached = []
    with pytest.raises(UserError, match="rpicam-hello"):
        source.open()


def test_a_dead_cable_at_the_start_is_named(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("pi_agent.cameras.pi_camera.FIRST_FRAME_S", 0.1)
    source = camera(OV9281)
    Picamera2.cable.clear()
    with pytest.raises(UserError, match="No frame"):
        source.open()
    source.close()
    assert Picamera2.last.closed


def test_a_missing_library_is_named(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "picamera2", None)
    source = camera(OV9281)
    with pytest.raises(UserError, match="python3-picamera2"):
        source.open()


# --- the fake against the package ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", picamera2_api.SOURCES)
def test_the_fake_has_the_packages_signatures(name: str):
    known = picamera2_api.snapshot()["signatures"][name]
    fake = getattr(fake_picamera2, name)
    for method, value in vars(fake).items():
        if (method.startswith("_") and not method.startswith("__")) or not callable(
            getattr(value, "__func__", getattr(value, "fget", value))
        ):
            continue
        if method in ("__annotations__", "__doc__", "__module__") or isinstance(value, type):
            continue
        assert method in known, f"{name}.{method} is not in picamera2 {picamera2_api.snapshot()['version']}"
        kind = {staticmethod: "staticmethod", property: "property"}.get(type(value), "method")
        assert kind == known[method]["kind"]
        function = getattr(value, "__func__", getattr(value, "fget", value))
        parameters = list(inspect.signature(function).parameters.values())
        assert [parameter.name for parameter in parameters] == known[method]["parameters"]
        optional = [parameter for parameter in parameters if parameter.default is not inspect.Parameter.empty]
        assert len(optional) == len(known[method]["defaults"])


def test_the_known_signatures_are_those_of_the_installed_package(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delitem(sys.modules, "picamera2")
    spec = importlib.util.find_spec("picamera2")
    if spec is None or not spec.submodule_search_locations:
        pytest.skip("picamera2 is not installed (it comes with Raspberry Pi OS); the snapshot of its signatures stands")
    installed = picamera2_api.signatures(Path(next(iter(spec.submodule_search_locations))))
    known = picamera2_api.snapshot()["signatures"]
    for name in picamera2_api.SOURCES:
        used = [method for method in vars(getattr(fake_picamera2, name)) if method in known[name]]
        assert {method: installed[name].get(method) for method in used} == {m: known[name][m] for m in used}
