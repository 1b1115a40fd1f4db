"""The Raspberry Pi's cameras through picamera2, which comes with the operating system (package python3-picamera2).

Nothing is assumed: the mode is negotiated, and rate, crop, exposure and gain are read back from the first frames. The
tone curve is made straight by the tuning file, because the default one moves every edge. Frames are the luminance
plane itself, mapped and not copied. What only hardware can show stands in pi_agent/cameras/README.md.
"""

from __future__ import annotations

import importlib
import os
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from pi_agent.cameras import CameraContext, CameraInfo, Frame, Image
from pi_agent.sensor_modes import Mode, Rectangle, choose_mode, row_time_ns, shutter_of
from pi_agent.tracking.tone import LINEAR, PI_DEFAULT
from shared.config import parse
from shared.errors import UserError

BUFFERS = 5
SETTLE_FRAMES = 12
"""Exposure and gain are in force within a few frames of the start; so many are looked at."""
FIRST_FRAME_S = 3.0
CONTROLS_OFF = {"AeEnable": False, "AwbEnable": False, "Sharpness": 0.0, "NoiseReductionMode": 0, "AfMode": 0}
"""Whatever would change the picture by itself; 0 is libcamera's `Off` for noise reduction and `Manual` for focus."""


@dataclass(frozen=True, kw_only=True)
class PiCameraOptions:
    """`[camera.options]`: number of the camera; lens position in dioptres (cameras with a motor); colour gains.

    `crop_px`: left, top, width, height on the sensor's full array (empty: the middle); `row_time_us`: of the mode's
    rows, for sensors with a rolling shutter that the agent does not know (0: known or measured); `linear_tone`: off
    leaves the processor's own curve, which is then undone on the pixels.
    """

    camera_number: int = 0
    lens_position: float = 0.0
    colour_gains: tuple[float, float] = (1.5, 1.5)
    crop_px: tuple[int, ...] = ()
    row_time_us: float = 0.0
    linear_tone: bool = True

    def __post_init__(self) -> None:
        """Refuses a crop that is no rectangle."""
        if len(self.crop_px) not in (0, 4) or min((*self.crop_px[2:], 1)) <= 0:
            raise ValueError("expected four numbers for 'crop_px' (left, top, width, height), or none")


class PiCamera:
    """One camera on the Pi's ribbon cable.

    picamera2 keeps the newest completed frame and recycles those that nobody fetched, which is what an agent wants.
    """

    def __init__(self, context: CameraContext) -> None:
        self._options = parse(PiCameraOptions, context.rig.camera.options)
        self._config, self._clock = context.rig.camera, context.clock
        self._picamera2: Any = None
        self._camera: Any = None
        self._job: Any = None
        self._held: Any = None
        self._mapped: Any = None
        self._info: CameraInfo | None = None
        self._above_ns = self._period_ns = 0.0
        self._seq, self._dropped, self._stamp_ns = -1, 0, 0

    def open(self) -> CameraInfo:
        """Starts the camera on the ribbon cable through picamera2, and says what it really does."""
        self._picamera2 = _library()
        number = self._options.camera_number
        found = self._picamera2.Picamera2.global_camera_info()
        if number >= len(found):
            raise UserError(
                f"Expected camera {number} on the ribbon cable, got {len(found)} cameras: check the cable and "
                "`rpicam-hello --list-cameras`"
            )
        model = str(found[number]["Model"])
        tuning = self._straight_tuning(model) if self._options.linear_tone else None
        try:
            self._camera = self._picamera2.Picamera2(number, tuning=tuning)
            mode = self._configure()
            self._camera.start()
            self._info = self._first_words(model, mode, linear=tuning is not None)
        except (RuntimeError, OSError) as error:
            self.close()
            raise UserError(
                f"The camera {model} does not start ({error}): does another program use it, is the cable seated?"
            ) from error
        return self._info

    def read(self, timeout_s: float) -> Frame | None:
        """Returns the newest frame with the time of its middle; None if none came within `timeout_s`."""
        self._let_go()
        metadata = self._fetch(timeout_s)
        if metadata is None or self._info is None:
            return None
        stamp_ns, exposure_ns = int(metadata["SensorTimestamp"]), round(1e3 * metadata["ExposureTime"])
        self._count(stamp_ns)
        return Frame(
            self._luminance(),
            self._clock.from_monotonic_ns(stamp_ns) + round(self._above_ns - exposure_ns / 2),
            self._seq,
            self._dropped,
            exposure_ns,
            float(metadata["AnalogueGain"]),
        )

    def close(self) -> None:
        """Stops the camera and gives it back; harmless when it is not open."""
        camera, self._camera = self._camera, None
        if camera is None:
            return
        self._let_go()
        with suppress(Exception):
            camera.cancel_all_and_flush()  # a job that waits for a frame that never comes would block the stop
        self._job = None
        with suppress(Exception):
            camera.stop()
        with suppress(Exception):
            camera.close()

    def _straight_tuning(self, model: str) -> dict[str, Any] | None:
        """Returns the sensor's tuning with a straight tone curve; None if the system has no file for it."""
        library = self._picamera2.Picamera2
        for name in (f"{model}.json", f"{model}_mono.json"):
            with suppress(RuntimeError, KeyError, StopIteration):
                tuning: dict[str, Any] = library.load_tuning_file(name)
                contrast = library.find_tuning_algo(tuning, "rpi.contrast")
                contrast["ce_enable"], contrast["gamma_curve"] = 0, [0, 0, 65535, 65535]
                return tuning
        return None

    def _configure(self) -> Mode:
        config, options, camera = self._config, self._options, self._camera
        size = (config.width_px, config.height_px)
        modes = [mode for entry in camera.sensor_modes if (mode := Mode.of(entry))]
        mode = choose_mode(modes, size_px=size, rate_hz=config.rate_hz)
        period_us = round(1e6 / min(config.rate_hz, mode.fps))
        if 1e3 * config.exposure_ms > period_us:
            raise UserError(
                f"Expected exposure_ms below {period_us / 1000:.2f}, one frame at {1e6 / period_us:.2f} Hz, got "
                f"{config.exposure_ms}"
            )
        controls = {
            **CONTROLS_OFF,
            "ExposureTime": round(1e3 * config.exposure_ms),
            "AnalogueGain": config.gain,
            "FrameDurationLimits": (period_us, period_us),
            "ColourGains": options.colour_gains,
            "LensPosition": options.lens_position,
            "ScalerCrop": options.crop_px or mode.crop_for(size),
        }
        # The preview configuration is the one with full-range luminance; sizes are not aligned, or 600 became 576.
        camera.configure(
            camera.create_preview_configuration(
                main={"format": "YUV420", "size": size},
                raw={"format": mode.format, "size": mode.size},
                buffer_count=BUFFERS,
                display=None,
                encode=None,
            )
        )
        camera.set_controls({name: value for name, value in controls.items() if name in camera.camera_controls})
        return mode

    def _first_words(self, model: str, mode: Mode, *, linear: bool) -> CameraInfo:
        """Starts the count, and reads what the camera really does from its first frames."""
        config = self._config
        self._seq, self._dropped, self._stamp_ns = -1, 0, 0
        wanted_us = 1e3 * config.exposure_ms
        metadata: dict[str, Any] | None = None
        for _ in range(SETTLE_FRAMES):
            metadata = self._fetch(FIRST_FRAME_S)
            self._let_go()
            if metadata is None:
                raise UserError(f"No frame from the camera {model} within {FIRST_FRAME_S} s: check its cable")
            if abs(metadata["ExposureTime"] - wanted_us) <= max(0.05 * wanted_us, 50):
                break
        assert metadata is not None
        size = tuple(self._camera.stream_configuration("main")["size"])
        if size != (config.width_px, config.height_px):
            raise UserError(
                f"Expected pictures of {config.width_px} x {config.height_px}, but the camera gives {size[0]} x "
                f"{size[1]}: write these into [camera]"
            )
        return self._describe(model, mode, metadata, linear=linear)

    def _describe(self, model: str, mode: Mode, metadata: dict[str, Any], *, linear: bool) -> CameraInfo:
        config = self._config
        self._period_ns = 1e3 * float(metadata["FrameDuration"])
        left, top, width, height = metadata.get("ScalerCrop") or mode.crop_limits
        crop: Rectangle = (left, top, width, height)
        configured_us = self._options.row_time_us
        line_ns = row_time_ns(model, mode, crop, picture_rows=config.height_px, configured_us=configured_us)
        rows_above, rows_inside = mode.rows_of(crop)
        mode_line_ns = (line_ns or 0.0) * config.height_px / rows_inside
        # SensorTimestamp is the start of the readout of the mode's first row, when that row's exposure ends.
        self._above_ns = mode_line_ns * rows_above + (line_ns or 0.0) * (config.height_px - 1) / 2
        shutter = "rolling" if line_ns else shutter_of(model)
        unknown = "" if line_ns is not None else "; row times unknown: set row_time_us in [camera.options]"
        return CameraInfo(
            name=model,
            width_px=config.width_px,
            height_px=config.height_px,
            rate_hz=1e9 / self._period_ns,
            shutter="unknown" if line_ns is None else shutter,
            line_ns=line_ns or 0.0,
            exposure_ns=round(1e3 * metadata["ExposureTime"]),
            gain=float(metadata["AnalogueGain"]),
            tone=LINEAR if linear else PI_DEFAULT,
            details=f"mode {mode.size[0]} x {mode.size[1]} {mode.format} to {mode.fps:.2f} Hz, crop {crop}{unknown}",
        )

    def _fetch(self, timeout_s: float) -> dict[str, Any] | None:
        """Holds the newest frame and returns its metadata; None when none came in time.

        The job of a wait that was given up stays in picamera2's list and would take a frame that nobody releases:
        hence it is kept, and waited for again.
        """
        job = self._job or self._camera.capture_request(wait=False)
        try:
            self._held, self._job = self._camera.wait(job, timeout=timeout_s), None
        except TimeoutError:
            self._job = job
            return None
        metadata: dict[str, Any] = self._held.get_metadata()
        return metadata

    def _luminance(self) -> Image:
        """Gives the Y plane (height, width) of the frame that is held: a view into its buffer, without its padding."""
        self._mapped = self._picamera2.MappedArray(self._held, "main", write=False)
        plane = self._mapped.__enter__().array
        return np.asarray(plane[: self._config.height_px, : self._config.width_px])

    def _let_go(self) -> None:
        if self._mapped is not None:
            self._mapped.__exit__(None, None, None)
        if self._held is not None:
            self._held.release()
        self._mapped = self._held = None

    def _count(self, stamp_ns: int) -> None:
        """Numbers the frame by the sensor's own clock: the buffers' numbers leave out frames that found no buffer."""
        steps = max(round((stamp_ns - self._stamp_ns) / self._period_ns), 1) if self._stamp_ns else 1
        self._seq, self._stamp_ns = self._seq + steps, stamp_ns
        self._dropped += steps - 1


def _library() -> Any:
    """Returns picamera2; looked for anew each time, so that installing it mends a running agent as a cable does."""
    # libcamera prints a page at every start unless it is told not to.
    os.environ.setdefault("LIBCAMERA_LOG_LEVELS", "*:WARN")
    importlib.invalidate_caches()
    try:
        return importlib.import_module("picamera2")
    except (ImportError, ValueError) as error:  # compiled against another NumPy, it raises ValueError
        raise UserError(
            f"Expected picamera2 for the Pi's camera, but it cannot be imported ({error}): `apt install "
            "python3-picamera2`, and a virtual environment made with --system-site-packages and the system's NumPy"
        ) from error


def build(context: CameraContext) -> PiCamera:
    """Builds the Pi's camera of a rig."""
    return PiCamera(context)
