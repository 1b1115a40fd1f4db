"""Chooses the sensor's mode for a picture, with the part of the sensor that it shows and the times of its rows.

Sensor coordinates are those of libcamera's `ScalerCrop`: pixels of the full array, whatever the mode bins. A mode's
rows are its own, after binning.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from shared.errors import UserError

Rectangle = tuple[int, int, int, int]
"""Left, top, width, height."""
RATE_SLACK = 0.995
"""A mode that is half a percent too slow counts as fast enough: 59.94 for 60."""


@dataclass(frozen=True)
class Sensor:
    """The facts of a sensor that no interface tells: its shutter, and the fewest blank rows after a picture.

    `least_blanking` pairs a mode's greatest height with its rows of blanking (the kernel's drivers' VBLANK_MIN): at
    the highest rate a frame takes height + blanking rows, which gives the time of one row.
    """

    shutter: Literal["global", "rolling"]
    least_blanking: tuple[tuple[int, int], ...] = ()


SENSORS = {
    "ov9281": Sensor("global"),
    "imx296": Sensor("global"),
    "imx219": Sensor("rolling", ((99_999, 32),)),
    "imx708": Sensor("rolling", ((1296, 40), (99_999, 58))),
    "ov5647": Sensor("rolling", ((99_999, 24),)),
}


@dataclass(frozen=True)
class Mode:
    """One mode as the driver offers it: size in its own pixels, highest rate, the part of the array that it shows."""

    format: str
    bit_depth: int
    size: tuple[int, int]
    fps: float
    crop_limits: Rectangle

    @staticmethod
    def of(entry: dict[str, Any]) -> Mode | None:
        """Reads an entry of picamera2's `sensor_modes`; None for an entry without size (a sensor that is not raw)."""
        if "size" not in entry or "fps" not in entry:
            return None
        left, top, width, height = (int(value) for value in entry["crop_limits"])
        width_px, height_px = (int(value) for value in entry["size"])
        return Mode(
            str(entry["format"]),
            int(entry["bit_depth"]),
            (width_px, height_px),
            float(entry["fps"]),
            (left, top, width, height),
        )

    def crop_for(self, size_px: tuple[int, int]) -> Rectangle:
        """Returns the largest rectangle in the middle of the mode's field of the picture's shape."""
        left, top, width, height = self.crop_limits
        wide = min(width, height * size_px[0] // size_px[1])
        high = min(height, width * size_px[1] // size_px[0])
        return left + (width - wide) // 2, top + (height - high) // 2, wide, high

    def sharpness(self, size_px: tuple[int, int]) -> float:
        """Returns the mode's pixels per pixel of the picture, along one side; below 1 the picture is blown up."""
        return self.crop_for(size_px)[2] * self.size[0] / self.crop_limits[2] / size_px[0]

    def rows_of(self, crop: Rectangle) -> tuple[float, float]:
        """Returns the mode's rows above a crop, and in it."""
        scale = self.size[1] / self.crop_limits[3]
        return (crop[1] - self.crop_limits[1]) * scale, crop[3] * scale


def choose_mode(modes: Sequence[Mode], *, size_px: tuple[int, int], rate_hz: float) -> Mode:
    """Returns the mode for a picture.

    It is not blown up and fast enough, then has the widest field, the most pixels, the fastest readout.

    Fast readout keeps a rolling shutter's rows close in time; what it costs in bits lies below the light's own noise.
    When none is fast enough the fastest is taken, and the true rate is said; when none is large enough the largest.

    Raises:
        UserError: if there are no modes.
    """
    if not modes:
        raise UserError("Expected a sensor with raw modes, got a camera without any: for a USB one use usb_camera")

    def merit(mode: Mode) -> tuple[float, ...]:
        enough_rate = min(mode.fps / rate_hz, RATE_SLACK)
        enough_pixels = min(mode.sharpness(size_px), 1.0)
        crop = mode.crop_for(size_px)
        return enough_pixels, enough_rate, crop[2] * crop[3], mode.size[0] * mode.size[1], mode.fps

    return max(modes, key=merit)


def row_time_ns(
    model: str, mode: Mode, crop: Rectangle, *, picture_rows: int, configured_us: float = 0.0
) -> float | None:
    """Returns the time from one row of the picture to the next; 0 for a global shutter, None when nobody knows.

    `configured_us`: the time of one row of the mode if the user knows it.
    """
    sensor = _sensor(model)
    if sensor and sensor.shutter == "global":
        return 0.0
    rows_per_picture_row = mode.rows_of(crop)[1] / picture_rows
    if configured_us > 0:
        return 1e3 * configured_us * rows_per_picture_row
    if sensor is None:
        return None
    blanking = next(rows for height, rows in sensor.least_blanking if mode.size[1] <= height)
    return 1e9 / (mode.fps * (mode.size[1] + blanking)) * rows_per_picture_row


def shutter_of(model: str) -> Literal["global", "rolling", "unknown"]:
    """Returns the kind of shutter of a sensor."""
    sensor = _sensor(model)
    return sensor.shutter if sensor else "unknown"


def _sensor(model: str) -> Sensor | None:
    return SENSORS.get(model.split("_", maxsplit=1)[0].lower())
