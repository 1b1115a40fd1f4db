"""USB cameras, and whatever else OpenCV can open as a live source.

A thread of its own takes every frame off the driver's queue, so that the newest one is never behind older ones. The
rate is measured, because these cameras say one and give another; exposure and gain are read back where the driver
tells them.
"""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from pi_agent.cameras import CameraContext, CameraInfo, Frame, Image
from pi_agent.tracking.tone import TONE_CURVES
from shared.config import parse
from shared.errors import UserError

MEASURED_FRAMES = 30
FIRST_FRAME_S = 5.0
MANUAL_EXPOSURE = 1
"""V4L2's exposure_auto: 1 is manual, 3 follows the light."""
EXPOSURE_UNIT_S = 1e-4
LARGEST_AGE_NS = 2_000_000_000
"""A driver's stamp that is older than this, or of the future, is not on the monotonic clock."""


@dataclass(frozen=True, kw_only=True)
class UsbCameraOptions:
    """`[camera.options]`: the device (a number, a path like /dev/video0, or a stream's address) and how to read it.

    `pixel_format`: four letters that the camera offers (`v4l2-ctl --list-formats`; empty: its own choice);
    `tone`: the curve of its processor; `latency_ms`: from the middle of the exposure to the frame's stamp;
    `shutter` and `row_time_us`: from its data sheet, because it does not tell.
    """

    device: str = "0"
    pixel_format: str = ""
    tone: str = "linear"
    latency_ms: float = 0.0
    shutter: Literal["global", "rolling", "unknown"] = "unknown"
    row_time_us: float = 0.0

    def __post_init__(self) -> None:
        """Refuses what contradicts itself."""
        if self.tone not in TONE_CURVES:
            raise ValueError(f"expected for 'tone' one of {', '.join(TONE_CURVES)}, got '{self.tone}'")
        if (self.shutter == "rolling") != (self.row_time_us > 0):
            raise ValueError("expected 'row_time_us' with shutter = \"rolling\", and only with it")
        if len(self.pixel_format) not in (0, 4):
            raise ValueError(f"expected four letters for 'pixel_format', got '{self.pixel_format}'")


class _Grabber:
    """Takes frames off a source as they come, and keeps the newest."""

    def __init__(self, source: cv2.VideoCapture) -> None:
        self._source = source
        self._news = threading.Condition()
        self._newest: tuple[Image, int] | None = None
        self.count = 0
        self.ended = False
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="usb camera", daemon=True)
        self._thread.start()

    def take(self, timeout_s: float) -> tuple[Image, int, int] | None:
        """Returns the newest frame, its stamp (ns, CLOCK_MONOTONIC) and its number; None when none came in time."""
        with self._news:
            self._news.wait_for(lambda: self._newest is not None or self.ended, timeout_s)
            newest, self._newest = self._newest, None
            return None if newest is None else (*newest, self.count - 1)

    def stop(self) -> None:
        """Ends the thread and gives the source back."""
        self._stop.set()
        self._thread.join(timeout=3.0)
        if not self._thread.is_alive():  # a driver that hangs keeps its source; releasing it then would crash
            self._source.release()

    def _run(self) -> None:
        while not self._stop.is_set():
            ok = self._source.grab()
            stamp_ns = _stamp_ns(self._source, time.monotonic_ns())
            ok, image = self._source.retrieve() if ok else (False, None)
            with self._news:
                if not ok or image is None:
                    self.ended = True
                else:
                    self._newest, self.count = (grey(image), stamp_ns), self.count + 1
                self._news.notify()
            if self.ended:
                return


class UsbCamera:
    """One source that OpenCV opens."""

    def __init__(self, context: CameraContext) -> None:
        self._options = parse(UsbCameraOptions, context.rig.camera.options)
        self._config, self._clock = context.rig.camera, context.clock
        self._grabber: _Grabber | None = None
        self._fetched, self._first = 0, 0

    def open(self) -> CameraInfo:
        """Opens the source with OpenCV, adjusts it, and measures its frame rate."""
        self.close()
        options, config = self._options, self._config
        device = int(options.device) if options.device.isdigit() else options.device
        source = cv2.VideoCapture(device)
        if not source.isOpened():
            raise UserError(
                f"Expected a camera at {options.device}, but it cannot be opened: is it plugged in, is the user in the "
                "group `video`, does another program use it?"
            )
        self._adjust(source)
        exposure_ms, gain = _read_back(source, exposure_ms=config.exposure_ms, gain=config.gain)
        grabber = self._grabber = _Grabber(source)
        rate_hz, image = self._measure(grabber)
        height, width = image.shape
        if (width, height) != (config.width_px, config.height_px):
            self.close()
            raise UserError(
                f"Expected pictures of {config.width_px} x {config.height_px} from {options.device}, got {width} x "
                f"{height}: write what the camera offers into [camera]"
            )
        self._first, self._fetched = grabber.count, 0
        return CameraInfo(
            name=f"usb camera {options.device}",
            width_px=width,
            height_px=height,
            rate_hz=rate_hz,
            shutter=options.shutter,
            line_ns=1e3 * options.row_time_us,
            exposure_ns=round(1e6 * exposure_ms),
            gain=gain,
            tone=TONE_CURVES[options.tone],
            details=f"rate measured over {MEASURED_FRAMES} frames",
        )

    def read(self, timeout_s: float) -> Frame | None:
        """Returns the newest frame that a thread has taken off the source; None if none came within `timeout_s`."""
        if self._grabber is None:
            raise UserError("Expected an open camera, got one that is closed")
        taken = self._grabber.take(timeout_s)
        if taken is None:
            if self._grabber.ended:
                raise UserError(f"The camera {self._options.device} gives no more frames: was it unplugged?")
            return None
        image, stamp_ns, number = taken
        seq = number - self._first
        self._fetched += 1
        capture_ns = self._clock.from_monotonic_ns(stamp_ns) - round(1e6 * self._options.latency_ms)
        return Frame(image, capture_ns, seq, seq + 1 - self._fetched)

    def close(self) -> None:
        """Ends the thread and gives the source back; harmless when it is not open."""
        grabber, self._grabber = self._grabber, None
        if grabber is not None:
            grabber.stop()

    def _adjust(self, source: cv2.VideoCapture) -> None:
        """Asks for the wanted picture; a source that cannot refuses silently, and what it gives is looked at later."""
        config, options = self._config, self._options
        if options.pixel_format:
            source.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*options.pixel_format))
        for name, value in (
            (cv2.CAP_PROP_FRAME_WIDTH, config.width_px),
            (cv2.CAP_PROP_FRAME_HEIGHT, config.height_px),
            (cv2.CAP_PROP_FPS, config.rate_hz),
            (cv2.CAP_PROP_BUFFERSIZE, 1),
            (cv2.CAP_PROP_AUTO_EXPOSURE, MANUAL_EXPOSURE),
            (cv2.CAP_PROP_EXPOSURE, 1e-3 * config.exposure_ms / EXPOSURE_UNIT_S),
            (cv2.CAP_PROP_GAIN, config.gain),
            (cv2.CAP_PROP_AUTOFOCUS, 0),
            (cv2.CAP_PROP_AUTO_WB, 0),
        ):
            source.set(name, value)

    def _measure(self, grabber: _Grabber) -> tuple[float, Image]:
        """Returns the rate that frames really come at, and one of them."""
        stamps: list[int] = []
        image: Image | None = None
        while len(stamps) < MEASURED_FRAMES:
            taken = grabber.take(FIRST_FRAME_S)
            if taken is None:
                self.close()
                raise UserError(f"No frame from {self._options.device} within {FIRST_FRAME_S} s: check its cable")
            image = taken[0]
            stamps.append(taken[1])
        assert image is not None
        # The median is not moved by the first frames, which come in a burst from the driver's queue.
        return 1e9 / float(np.median(np.diff(stamps))), image


def grey(image: np.ndarray) -> Image:
    """Returns the luminance (height, width) of what OpenCV retrieved: grey, luminance and chroma in turns, or colours.

    `image` (height, width) or (height, width, channels) has 8-bit values.
    """
    if image.ndim == 2:
        return np.asarray(image, dtype=np.uint8)
    if image.shape[2] <= 2:
        return np.asarray(image[:, :, 0], dtype=np.uint8)
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def _stamp_ns(source: cv2.VideoCapture, now_ns: int) -> int:
    """Returns the moment at which the kernel stamped the frame (V4L2 gives that in POS_MSEC), or else now."""
    stamp_ns = round(1e6 * source.get(cv2.CAP_PROP_POS_MSEC))
    return stamp_ns if 0 < now_ns - stamp_ns < LARGEST_AGE_NS else now_ns


def _read_back(source: cv2.VideoCapture, *, exposure_ms: float, gain: float) -> tuple[float, float]:
    """Reads exposure (ms) and gain as the driver tells them, or as they were asked for where it does not."""
    reported, reported_gain = source.get(cv2.CAP_PROP_EXPOSURE), source.get(cv2.CAP_PROP_GAIN)
    return (1e3 * EXPOSURE_UNIT_S * reported if reported > 0 else exposure_ms), (
        reported_gain if reported_gain > 0 else gain
    )


def build(context: CameraContext) -> UsbCamera:
    """Builds the USB camera of a rig."""
    return UsbCamera(context)
