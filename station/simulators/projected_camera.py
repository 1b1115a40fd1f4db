"""A camera without pixels: the block's corners, projected and with noise, as the camera agent would report them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from operator import add

import numpy as np

from shared import frames
from shared.bus import Bus
from shared.clock import SIMULATION_EPOCH_NS
from shared.foxglove import Timestamp
from shared.geometry import pixels_of_mark
from shared.messages import AgentStatus, CameraGeometry, MarkerCorners, TwinScene

_CORNER_SIGNS = ((-1, 1), (1, 1), (1, -1), (-1, -1))
_TIPPED_COSINE = math.cos(math.radians(4.0))
_NOISE_BLOCK = 512


@dataclass(frozen=True, kw_only=True)
class ProjectionSettings:
    """Noise of one corner coordinate, exposure, rates, and how far the picture moves when the plate stands upright."""

    sigma_px: float = 0.06
    exposure_ns: int = 2_000_000
    rate_hz: float = 90.0
    plate_rate_hz: float = 15.0
    sag_px: float = 0.0


class ProjectedCamera:
    """Publishes `camera/corners` at every tick, and plate fiducial, geometry and status at their own rates."""

    def __init__(
        self,
        bus: Bus,
        *,
        geometry: CameraGeometry,
        size_px: tuple[int, int],
        fiducial_m: tuple[float, float],
        fiducial_side_m: float,
        rng: np.random.Generator,
        settings: ProjectionSettings | None = None,
    ) -> None:
        self._bus, self._geometry, self._size_px, self._rng = bus, geometry, size_px, rng
        self._settings = settings or ProjectionSettings()
        homography = np.linalg.inv(np.reshape(geometry.plate_from_pixel, (3, 3)))
        if abs(homography[2, :2]).max() > 1e-12:
            raise ValueError("the camera without pixels looks straight down; a tilted view needs --pixels")
        raised = 1.0 / (1.0 - geometry.mark_height_m / geometry.camera_height_m)
        self._scale = float(homography[0, 0]) * raised
        self._centre = (float(homography[0, 2]), float(homography[1, 2]))
        half = 0.5 * geometry.marker_side_m
        self._half = (half, half * geometry.marker_aspect)
        self._plate = _fiducial(geometry, fiducial_m, side_m=fiducial_side_m)
        self._calibration = frames.calibration(
            width_px=size_px[0], height_px=size_px[1], K=frames.pinhole_of(geometry), stamp_ns=0
        )
        self._noise: list[list[float]] = []
        self._seq = self._plate_seq = 0
        self._every_plate = max(1, round(self._settings.rate_hz / self._settings.plate_rate_hz))

    def tick(self, now_ns: int, scene: TwinScene) -> None:
        """The frame whose exposure has its middle at `now_ns`."""
        self._bus.publish("camera/corners", self._see_block(now_ns, scene))
        if self._seq % self._every_plate == 1:
            self._bus.publish("camera/plate", self._see_plate(now_ns, scene))
        if self._seq % round(self._settings.rate_hz) == 1:
            self._report(now_ns)

    def _see_block(self, now_ns: int, scene: TwinScene) -> MarkerCorners:
        self._seq += 1
        corners = tuple(map(add, self._project(scene), self._next_noise()))
        inside = self._inside(corners)
        settings = self._settings
        return MarkerCorners(
            now_ns,
            self._seq,
            corners if inside else (),
            settings.sigma_px,
            settings.sigma_px,
            settings.exposure_ns,
            (0, 0, 0, 0),
            inside,
            "" if inside else "the marker is out of the frame",
            tipped=1.0 - 2.0 * (scene.block_qx**2 + scene.block_qy**2) < _TIPPED_COSINE,
        )

    def _inside(self, corners: tuple[float, ...]) -> bool:
        width, height = self._size_px
        if min(corners) < 0:
            return False
        return max(corners) < min(width, height) or (max(corners[0::2]) < width and max(corners[1::2]) < height)

    def _project(self, scene: TwinScene) -> tuple[float, ...]:
        """Where the corners are without noise, x0 y0 … x3 y3: the mark turned by the block's yaw, scaled, shifted."""
        qw, qx, qy, qz = scene.block_qw, scene.block_qx, scene.block_qy, scene.block_qz
        yaw, scale = math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz)), self._scale
        cosine, sine = scale * math.cos(yaw), scale * math.sin(yaw)
        u0, v0 = self._sag(scene)
        u0, v0 = u0 + self._centre[0] + scale * scene.block_x_m, v0 + self._centre[1] - scale * scene.block_y_m
        half_x, half_y = self._half
        # The corners lie at (−x, y), (x, y), (x, −y), (−x, −y) in the block; the image's y runs downwards.
        a, b, c, d = cosine * half_x, sine * half_y, sine * half_x, cosine * half_y
        return (
            *(u0 - a - b, v0 + c - d, u0 + a - b, v0 - c - d),
            *(u0 + a + b, v0 - c + d, u0 - a + b, v0 + c + d),
        )

    def _sag(self, scene: TwinScene) -> tuple[float, float]:
        """The picture's shift: the camera sinks along gravity, so what it sees moves the other way."""
        down_x = -2.0 * (scene.qx * scene.qz - scene.qw * scene.qy)
        down_y = -2.0 * (scene.qy * scene.qz + scene.qw * scene.qx)
        return -self._settings.sag_px * down_x, self._settings.sag_px * down_y

    def _see_plate(self, now_ns: int, scene: TwinScene) -> MarkerCorners:
        self._plate_seq += 1
        noise, shift = self._next_noise(), self._sag(scene)
        corners = tuple(value + noise[k] + shift[k % 2] for k, value in enumerate(self._plate))
        sigma = self._settings.sigma_px
        return MarkerCorners(
            now_ns,
            self._plate_seq,
            corners,
            sigma,
            sigma,
            self._settings.exposure_ns,
            (0, 0, 0, 0),
            found=True,
            marker_id=1,
        )

    def _next_noise(self) -> list[float]:
        if not self._noise:
            self._noise = (self._settings.sigma_px * self._rng.standard_normal((_NOISE_BLOCK, 8))).tolist()
        return self._noise.pop()

    def _report(self, now_ns: int) -> None:
        self._bus.publish("camera/geometry", replace(self._geometry, stamp_ns=now_ns))
        self._bus.publish("camera/calibration", replace(self._calibration, timestamp=Timestamp.from_ns(now_ns)))
        status = AgentStatus(
            stamp_ns=now_ns,
            frames=self._seq,
            exposure_ns=self._settings.exposure_ns,
            gain=1.0,
            version="projected",
            rate_hz=self._settings.rate_hz,
            boot_id=SIMULATION_EPOCH_NS,
        )
        self._bus.publish("camera/status", status)


def _fiducial(geometry: CameraGeometry, centre_m: tuple[float, float], *, side_m: float) -> tuple[float, ...]:
    on_plate = replace(geometry, mark_height_m=0.0)
    corners = [(centre_m[0] + 0.5 * side_m * sx, centre_m[1] + 0.5 * side_m * sy) for sx, sy in _CORNER_SIGNS]
    return tuple(float(value) for value in pixels_of_mark(corners, on_plate).ravel())
