"""A picamera2 without a camera: the parts of its API that the driver uses, with the same signatures and manners.

Its manners are those of version 0.3.38: one completed frame is kept and older ones are recycled; a waiting job takes
the next frame; a frame without a free buffer is lost; controls that the camera does not have are refused; rows are
padded to the stride; exposure is a whole number of rows and comes into force some frames after the start.
"""

# ruff: noqa: ARG002, ARG004, B006, PLR0917  # the signatures are the package's, not ours
from __future__ import annotations

import copy
import threading
import time
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

STRIDE = 64
LATE_EXPOSURE = 2
"""Frames after the start that still have the exposure of before."""


@dataclass
class Sensor:
    """A sensor to be found on the ribbon cable. `modes`: size, highest rate, bits, crop limits."""

    model: str
    modes: list[tuple[tuple[int, int], float, int, tuple[int, int, int, int]]]
    line_us: float = 10.0
    mono: bool = False
    has_lens: bool = False
    has_tuning: bool = True
    busy: bool = False
    adjusted_size: tuple[int, int] | None = None


OV5647 = Sensor(
    "ov5647",
    [
        ((640, 480), 58.92, 10, (16, 0, 2560, 1920)),
        ((1296, 972), 46.34, 10, (0, 0, 2592, 1944)),
        ((2592, 1944), 15.63, 10, (0, 0, 2592, 1944)),
    ],
    line_us=33.67,
)
IMX219 = Sensor(
    "imx219",
    [
        ((640, 480), 206.65, 8, (1000, 752, 1280, 960)),
        ((1640, 1232), 83.7, 8, (0, 0, 3280, 2464)),
        ((3280, 2464), 21.19, 8, (0, 0, 3280, 2464)),
        ((640, 480), 103.33, 10, (1000, 752, 1280, 960)),
        ((1640, 1232), 41.85, 10, (0, 0, 3280, 2464)),
    ],
    line_us=9.452,
)
OV9281 = Sensor(
    "ov9281",
    [
        ((640, 400), 247.83, 8, (0, 0, 1280, 800)),
        ((1280, 720), 171.79, 8, (0, 0, 1280, 720)),
        ((1280, 800), 143.66, 8, (0, 0, 1280, 800)),
        ((1280, 800), 120.48, 10, (0, 0, 1280, 800)),
    ],
    mono=True,
)
IMX708 = Sensor(
    "imx708_wide",
    [
        ((1536, 864), 120.13, 10, (768, 432, 3072, 1728)),
        ((2304, 1296), 56.03, 10, (0, 0, 4608, 2592)),
        ((4608, 2592), 14.35, 10, (0, 0, 4608, 2592)),
    ],
    line_us=9.209,
    has_lens=True,
)
IMX296 = Sensor("imx296", [((1456, 1088), 60.38, 10, (0, 0, 1456, 1088))], mono=True)
UNHEARD_OF = Sensor("xy1234", [((1280, 960), 100.0, 10, (0, 0, 1280, 960))])


class CompletedRequest:
    """A frame in a buffer."""

    def __init__(self, request: Any, picam2: Picamera2) -> None:
        self.request: Any = request
        self.picam2 = picam2
        self.ref_count = 1
        self.config = copy.deepcopy(picam2.camera_config)

    def acquire(self) -> None:
        assert self.ref_count > 0
        self.ref_count += 1

    def release(self) -> None:
        self.ref_count -= 1
        assert self.ref_count >= 0, "released once too often"
        if self.ref_count == 0:
            self.picam2.free_buffers += 1
            self.request["buffer"][:] = 255  # the hardware writes into it again
            self.request = None

    def get_metadata(self) -> dict[str, Any]:
        return dict(self.request["metadata"])


class MappedArray:
    """A frame's memory."""

    open_maps: ClassVar[int] = 0

    def __init__(self, request: CompletedRequest, stream: str, reshape: bool = True, write: bool = True) -> None:
        self._request, self._stream, self._reshape, self._write = request, stream, reshape, write
        self._array: np.ndarray | None = None

    def __enter__(self) -> MappedArray:
        buffer = self._request.request["buffer"]
        config = self._request.config[self._stream]
        rows = config["size"][1] * 3 // 2
        self._array = buffer.reshape((rows, config["stride"])) if self._reshape else buffer
        MappedArray.open_maps += 1
        return self

    def __exit__(self, exc_type: Any, exc_value: Any, exc_traceback: Any) -> None:
        MappedArray.open_maps -= 1
        self._array = None

    @property
    def array(self) -> np.ndarray | None:
        return self._array


@dataclass
class _Job:
    future: Future[CompletedRequest] = field(default_factory=Future)

    def get_result(self, timeout: float | None = None) -> CompletedRequest:
        return self.future.result(timeout=timeout)


class Picamera2:
    """The camera. `attached` are the sensors on the cable; `cable` cleared means that no frames arrive."""

    attached: ClassVar[list[Sensor]] = []
    cable: ClassVar[threading.Event] = threading.Event()
    last: ClassVar[Picamera2]

    @staticmethod
    def global_camera_info() -> list[dict[str, Any]]:
        return [
            {"Model": sensor.model, "Location": 2, "Rotation": 0, "Id": f"/base/{n}", "Num": n}
            for n, sensor in enumerate(Picamera2.attached)
        ]

    @staticmethod
    def load_tuning_file(tuning_file: str, dir: str | None = None) -> dict[str, Any]:
        for sensor in Picamera2.attached:
            if sensor.has_tuning and tuning_file == (
                f"{sensor.model}_mono.json" if sensor.mono else f"{sensor.model}.json"
            ):
                curve = {"ce_enable": 1, "gamma_curve": [0, 0, 1024, 5040, 65535, 65535]}
                return {"version": 2.0, "algorithms": [{"rpi.agc": {}}, {"rpi.contrast": curve}]}
        raise RuntimeError("Tuning file not found")

    @staticmethod
    def find_tuning_algo(tuning: dict[str, Any], name: str) -> dict[str, Any]:
        return next(algo for algo in tuning["algorithms"] if name in algo)[name]

    def __init__(
        self, camera_num: int = 0, verbose_console: Any = None, tuning: Any = None, allocator: Any = None
    ) -> None:
        self.sensor = Picamera2.attached[camera_num]
        if self.sensor.busy:
            raise RuntimeError("Camera __init__ sequence did not complete.")
        Picamera2.last = self
        self.tuning = tuning
        self.camera_config: dict[str, Any] = {}
        self.controls: dict[str, Any] = {}
        self.started = self.closed = False
        self.free_buffers = 0
        self.lost = 0
        self._lock = threading.Lock()
        self._completed: list[CompletedRequest] = []
        self._jobs: list[_Job] = []
        self._thread: threading.Thread | None = None
        self._stop = threading.Event()

    @property
    def sensor_modes(self) -> list[dict[str, Any]]:
        assert not self.started, "reading the modes reconfigures the camera"
        return self._modes()

    def _modes(self) -> list[dict[str, Any]]:
        letter = "R" if self.sensor.mono else "SRGGB"
        return [
            {
                "format": f"{letter}{bits}_CSI2P" if bits > 8 else f"{letter}{bits}",
                "unpacked": f"{letter}{bits}",
                "bit_depth": bits,
                "size": size,
                "fps": fps,
                "crop_limits": crop,
                "exposure_limits": (round(4 * self.sensor.line_us), 11_000_000),
            }
            for size, fps, bits, crop in self.sensor.modes
        ]

    @property
    def camera_controls(self) -> dict[str, tuple[Any, Any, Any]]:
        names = [
            "AeEnable",
            "ExposureTime",
            "AnalogueGain",
            "FrameDurationLimits",
            "Sharpness",
            "NoiseReductionMode",
            "ScalerCrop",
        ]
        names += [] if self.sensor.mono else ["AwbEnable", "ColourGains"]
        names += ["AfMode", "LensPosition"] if self.sensor.has_lens else []
        return dict.fromkeys(names, (None, None, None))

    def create_preview_configuration(
        self,
        main: Any = {},
        lores: Any = None,
        raw: Any = {},
        transform: Any = None,
        colour_space: Any = None,
        buffer_count: int = 4,
        controls: Any = {},
        display: Any = "main",
        encode: Any = "main",
        queue: bool = True,
        sensor: Any = {},
        use_case: str = "preview",
    ) -> dict[str, Any]:
        full: dict[str, Any] = {"format": "XBGR8888", "size": (640, 480), "preserve_ar": True, **main}
        full["size"] = (full["size"][0] // 2 * 2, full["size"][1] // 2 * 2)
        return {
            "main": full,
            "raw": {**raw},
            "buffer_count": buffer_count,
            "queue": queue,
            "display": display,
            "encode": encode,
            "controls": {"FrameDurationLimits": (100, 83333), **controls},
        }

    def configure(self, camera_config: Any = None) -> None:
        if self.started:
            raise RuntimeError("Camera must be stopped before configuring")
        config = copy.deepcopy(camera_config)
        raw = config["raw"]
        assert (raw["format"], raw["size"]) in {(m["format"], m["size"]) for m in self._modes()}, "no such mode"
        assert config["main"]["format"] == "YUV420"
        if self.sensor.adjusted_size:
            config["main"]["size"] = self.sensor.adjusted_size
        width = config["main"]["size"][0]
        config["main"]["stride"] = -(-width // STRIDE) * STRIDE
        self.camera_config = config
        self.controls = dict(config["controls"])

    def stream_configuration(self, name: str = "main") -> dict[str, Any]:
        return self.camera_config[name]

    def set_controls(self, controls: dict[str, Any]) -> None:
        for name in controls:
            if name not in self.camera_controls:
                raise RuntimeError(f"Control {name} is not advertised by libcamera")
        self.controls.update(controls)

    def start(self, config: Any = None, show_preview: Any = False) -> None:
        if not self.camera_config:
            raise RuntimeError("Camera has not been configured")
        self.started, self.free_buffers = True, self.camera_config["buffer_count"]
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join(timeout=5)
        self.started = False

    def close(self) -> None:
        self.stop()
        self.closed = True

    def cancel_all_and_flush(self) -> None:
        with self._lock:
            self._jobs = []

    def capture_request(self, wait: Any = None, signal_function: Any = None, flush: Any = None) -> Any:
        if self.closed or not self.started:
            raise RuntimeError("Camera is not running")
        job = _Job()
        with self._lock:
            self._jobs.append(job)
            self._serve()
        return job.get_result(None if wait in (None, True) else wait) if wait or wait is None else job

    def wait(self, job: Any, timeout: float | None = None) -> Any:
        return job.get_result(timeout=timeout)

    # --- the hardware ------------------------------------------------------------------------------------------------

    def _serve(self) -> None:
        while self._jobs and self._completed:
            self._jobs.pop(0).future.set_result(self._completed.pop(0))

    def _mode(self) -> tuple[tuple[int, int], float, int, tuple[int, int, int, int]]:
        raw = self.camera_config["raw"]
        found = next(m for m in self._modes() if (m["format"], m["size"]) == (raw["format"], raw["size"]))
        return found["size"], found["fps"], found["bit_depth"], found["crop_limits"]

    def _run(self) -> None:
        fastest_us = 1e6 / self._mode()[1]
        period_us = max(self.controls["FrameDurationLimits"][0], fastest_us)
        start_ns, number = time.monotonic_ns(), 0
        while not self._stop.is_set():
            number += 1
            stamp_ns = start_ns + round(number * period_us * 1e3)
            time.sleep(max(stamp_ns - time.monotonic_ns(), 0) * 1e-9)
            if Picamera2.cable.is_set():
                self._frame(number, stamp_ns, period_us)

    def _frame(self, number: int, stamp_ns: int, period_us: float) -> None:
        with self._lock:
            if self.free_buffers == 0:
                self.lost += 1
                return
            self.free_buffers -= 1
            self._completed.append(CompletedRequest(self._content(number, stamp_ns, period_us), self))
            self._serve()
            while len(self._completed) > (1 if self.camera_config["queue"] else 0):
                self._completed.pop(0).release()

    def _content(self, number: int, stamp_ns: int, period_us: float) -> dict[str, Any]:
        width, height = self.camera_config["main"]["size"]
        stride = self.camera_config["main"]["stride"]
        buffer = np.full(height * 3 // 2 * stride, 128, dtype=np.uint8)
        plane = buffer.reshape((-1, stride))[:height]
        plane[:, :width], plane[:, width:] = number % 100, 99
        exposure_us = 8000.0 if number <= LATE_EXPOSURE else float(self.controls["ExposureTime"])
        line_us = self.sensor.line_us
        metadata = {
            "SensorTimestamp": stamp_ns,
            "ExposureTime": int(max(exposure_us // line_us, 1) * line_us),
            "AnalogueGain": self.controls["AnalogueGain"],
            "FrameDuration": round(period_us),
            "ScalerCrop": tuple(self.controls["ScalerCrop"]),
            "SensorTemperature": 31.0,
        }
        return {"buffer": buffer, "metadata": metadata}
