"""Cameras, one file each in this folder, loaded by the name that `[camera] driver` gives; here is what all of them are.

A driver's file has a function `build(context: CameraContext) -> Camera`. It reads its own settings from the table
`[camera.options]`; nothing else has to be told about it.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking.shutter import Shutter
from pi_agent.tracking.tone import LINEAR, ToneCurve
from shared.bus import Bus
from shared.clock import SystemClock
from shared.errors import UserError
from shared.rig import RigConfig

Image = NDArray[np.uint8]


@dataclass(frozen=True, kw_only=True)
class CameraInfo:
    """The camera's true settings, as it said itself after `open`.

    `line_ns`: from one row's exposure to the next's (0 for a global shutter); `tone`: the curve from light to pixel
    values; `details`: mode and crop in words, for the log; `noiseless`: two pictures of one scene are the same.
    """

    name: str
    width_px: int
    height_px: int
    rate_hz: float
    shutter: Literal["global", "rolling", "unknown"] = "unknown"
    line_ns: float = 0.0
    exposure_ns: int = 0
    gain: float = 1.0
    tone: ToneCurve = LINEAR
    details: str = ""
    noiseless: bool = False

    @property
    def row_times(self) -> Shutter:
        """Each row's mid-exposure relative to `Frame.capture_ns`, which is the middle row's."""
        return Shutter(self.line_ns, self.exposure_ns, -self.line_ns * (self.height_px - 1) / 2)

    def __str__(self) -> str:
        """Returns one line for the log."""
        line = f", {self.line_ns / 1000:.2f} µs a row" if self.line_ns else ""
        return (
            f"{self.name}: {self.width_px} x {self.height_px} at {self.rate_hz:.2f} Hz, {self.shutter} shutter{line}, "
            f"exposure {self.exposure_ns / 1e6:.2f} ms, gain {self.gain:.2f}, tone curve {self.tone.name}"
            + (f"; {self.details}" if self.details else "")
        )


@dataclass(frozen=True, slots=True)
class Frame:
    """One picture.

    `image`: (height, width) uint8, possibly a view into the driver's buffer: valid until the next `read`.
    `capture_ns`: mid-exposure of the middle row, on the agent's clock. `seq`: the sensor's own count, with gaps where
    frames were lost; `dropped`: how many were lost since `open`. `exposure_ns` and `gain`: zero if the driver does not
    know them for this very frame.
    """

    image: Image
    capture_ns: int
    seq: int
    dropped: int = 0
    exposure_ns: int = 0
    gain: float = 0.0


class Camera(Protocol):
    """A source of frames. It may be opened again after `close`."""

    def open(self) -> CameraInfo:
        """Starts the camera and says what it really does.

        Raises:
            UserError: if it cannot be had; the agent tries again later.
        """
        ...

    def read(self, timeout_s: float) -> Frame | None:
        """Returns the newest frame that was not read yet: frames that nobody fetched are counted, never queued.

        None after `timeout_s` without a frame.

        Raises:
            UserError: if no frame can come any more; the agent closes the camera and opens it again.
        """
        ...

    def close(self) -> None:
        """Stops the camera; harmless when it is not open."""
        ...


@dataclass(frozen=True, kw_only=True)
class CameraContext:
    """The things that a driver is given: the rig, the folder of its paths, the bus and the clock for stamps."""

    rig: RigConfig
    bus: Bus
    clock: SystemClock
    folder: Path = Path()


def camera_names() -> tuple[str, ...]:
    """Returns the drivers that there are: the files of this folder."""
    return tuple(sorted(module.name for module in pkgutil.iter_modules(__path__)))


def load_camera(context: CameraContext) -> Camera:
    """Loads the camera that `[camera] driver` names, not yet open; no other driver's file is read.

    Raises:
        UserError: if there is no such driver, its library is missing, or its options are wrong.
    """
    name = context.rig.camera.driver
    if name not in camera_names():
        raise UserError(f"Expected for 'camera.driver' one of {', '.join(camera_names())}, got '{name}'")
    build: Callable[[CameraContext], Camera] = importlib.import_module(f"{__name__}.{name}").build
    return build(context)
