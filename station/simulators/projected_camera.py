"""A camera without pixels: the block's corners, projected and with noise, as the camera agent would report them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import cv2
import numpy as np

from shared import frames
from shared.bus import Bus, Recipe
from shared.clock import SIMULATION_EPOCH_NS
from shared.foxglove import Timestamp
from shared.geometry import mark_scale, pixels_of_mark
from shared.messages import AgentStatus, CameraGeometry, MarkerCorners

_CORNER_SIGNS = ((-1, 1), (1, 1), (1, -1), (-1, -1))
_TIPPED_COSINE = math.cos(math.radians(4.0))
_NOISE_BLOCK = 32
_SEEN_PX = 0.5
"""Corners are shown anew when one has moved by more than this: less is not seen, and noise moves them by less."""
_BLANK = 110
"""The grey of the blank picture, on which light and dark lines are seen."""
Shift = tuple[float, float]
Corners = tuple[float, float, float, float, float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class ProjectionSettings:
    """Noise of one corner coordinate, exposure, rates, and how far the picture moves when the plate stands upright.

    `preview_hz` is how often the corners are shown over the picture; 0: neither is.
    """

    sigma_px: float = 0.06
    exposure_ns: int = 2_000_000
    rate_hz: float = 90.0
    plate_rate_hz: float = 15.0
    preview_hz: float = 0.0
    sag_px: float = 0.0


class Placed(Protocol):
    """The pose of a block in a frame: position (m) and quaternion (w, x, y, z)."""

    @property
    def position(self) -> tuple[float, float, float]:
        """The place of its middle."""
        ...

    @property
    def quaternion(self) -> tuple[float, float, float, float]:
        """Its attitude."""
        ...


class SeenWorld(Protocol):
    """The visible world at the moment of a frame."""

    def plate_quaternion(self) -> Sequence[float]:
        """Returns world_from_plate as (w, x, y, z)."""
        ...

    def block_pose(self) -> Placed:
        """Returns plate_from_block; the same object while the block rests."""
        ...


class ProjectedCamera:
    """Publishes `camera/corners` at every tick, and plate fiducial, geometry and status at their own rates."""

    def __init__(
        self,
        bus: Bus,
        world: SeenWorld,
        *,
        geometry: CameraGeometry,
        size_px: tuple[int, int],
        fiducial_m: tuple[float, float],
        fiducial_side_m: float,
        rng: np.random.Generator,
        settings: ProjectionSettings | None = None,
    ) -> None:
        self._bus, self._world, self._geometry, self._size_px, self._rng = bus, world, geometry, size_px, rng
        self._settings = settings or ProjectionSettings()
        homography = np.linalg.inv(np.reshape(geometry.plate_from_pixel, (3, 3)))
        if abs(homography[2, :2]).max() > 1e-12:
            raise ValueError("the camera without pixels looks straight down; a tilted view needs --pixels")
        self._scale = float(homography[0, 0]) * (1.0 / mark_scale(geometry))
        self._centre = (float(homography[0, 2]), float(homography[1, 2]))
        half = 0.5 * geometry.marker_side_m
        self._half = (half, half * geometry.marker_aspect)
        self._plate = _fiducial(geometry, fiducial_m, side_m=fiducial_side_m)
        self._calibration = frames.calibration(
            width_px=size_px[0], height_px=size_px[1], K=frames.pinhole_of(geometry), stamp_ns=0
        )
        self._depth_m = geometry.camera_height_m - geometry.mark_height_m
        self._shown_px: Sequence[float] = ()
        self._noise: list[list[float]] = []
        self._stray_px = 0.0
        """The largest shift of a corner by sag and the noise at hand, px."""
        self._pose: Placed | None = None
        self._corners: Corners = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self._room_px = 0.0
        """The distance of the corners from the picture's edges without sag and noise, px."""
        self._tipped = False
        self._seq = self._plate_seq = 0
        self._every_plate = max(1, round(self._settings.rate_hz / self._settings.plate_rate_hz))
        preview_hz = self._settings.preview_hz
        self._every_preview = max(2, round(self._settings.rate_hz / preview_hz)) if preview_hz > 0 else 0

    def tick(self, now_ns: int) -> None:
        """Takes the frame whose exposure has its middle at `now_ns`."""
        sag_px = self._sag()
        corners = self._see_block(now_ns, sag_px)
        self._bus.publish("camera/corners", corners)
        if self._seq % self._every_plate == 1:
            self._bus.publish("camera/plate", self._see_plate(now_ns, sag_px))
        if self._every_preview and self._seq % self._every_preview == 1:
            self._show(corners)
        if self._seq % round(self._settings.rate_hz) == 1:
            self._report(now_ns)

    def _show(self, corners: MarkerCorners) -> None:
        """Shows viewers the corners over a blank picture, for want of another one, and anew when they have moved."""
        pairs = zip(corners.corners_px, self._shown_px, strict=False)
        still = len(corners.corners_px) == len(self._shown_px) and all(abs(a - b) < _SEEN_PX for a, b in pairs)
        if (still and corners.seq > 1) or not self._bus.carries("camera/image/overlay"):
            return
        if corners.seq == 1:
            width, height = self._size_px
            blank = cv2.imencode(".png", np.full((height, width), _BLANK, dtype=np.uint8))[1].tobytes()
            self._bus.publish("camera/image", frames.image(blank, stamp_ns=corners.capture_ns, encoding="png"))
        self._shown_px = corners.corners_px
        seen = {
            "corners_px": self._shown_px,
            "K": self._calibration.K,
            "depth_m": self._depth_m,
            "stamp_ns": corners.capture_ns,
        }
        self._bus.publish("camera/image/overlay", Recipe(frames.overlay, seen))

    def _see_block(self, now_ns: int, sag_px: Shift) -> MarkerCorners:
        self._seq += 1
        pose = self._world.block_pose()
        if pose is not self._pose:
            self._pose, self._corners, self._tipped = pose, self._corners_of(pose), _tipped(pose)
            self._room_px = self._room_of(self._corners)
        a, b, c, d, e, f, g, h = self._next_noise()
        (u, v), (x0, y0, x1, y1, x2, y2, x3, y3) = sag_px, self._corners
        corners = x0 + u + a, y0 + v + b, x1 + u + c, y1 + v + d, x2 + u + e, y2 + v + f, x3 + u + g, y3 + v + h
        inside = self._room_px > self._stray_px or self._room_of(corners) > 0.0
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
            tipped=self._tipped,
        )

    def _room_of(self, corners: Corners) -> float:
        """Returns the distance of the nearest corner from the picture's edges, px; negative beyond them."""
        width, height = self._size_px
        across, down = corners[0::2], corners[1::2]
        return min(*across, width - max(across), *down, height - max(down))

    def _corners_of(self, pose: Placed) -> Corners:
        """Returns the corners without sag and noise, x0 y0 … x3 y3, in pixels.

        They lie at (−x, y), (x, y), (x, −y), (−x, −y) in the block; the image's y runs downwards.
        """
        (x, y, _), (qw, qx, qy, qz), (half_x, half_y) = pose.position, pose.quaternion, self._half
        yaw, scale = math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz)), self._scale
        cosine, sine = scale * math.cos(yaw), scale * math.sin(yaw)
        a, b, c, d = cosine * half_x, sine * half_y, sine * half_x, cosine * half_y
        u, v = self._centre[0] + scale * x, self._centre[1] - scale * y
        return u - a - b, v + c - d, u + a - b, v - c - d, u + a + b, v - c + d, u - a + b, v + c + d

    def _sag(self) -> Shift:
        """Returns the picture's shift: the camera sinks along gravity, so what it sees moves the other way."""
        sag_px = self._settings.sag_px
        if sag_px == 0.0:
            return 0.0, 0.0
        qw, qx, qy, qz = self._world.plate_quaternion()
        down_x, down_y = -2.0 * (qx * qz - qw * qy), -2.0 * (qy * qz + qw * qx)
        return -sag_px * down_x, sag_px * down_y

    def _see_plate(self, now_ns: int, sag_px: Shift) -> MarkerCorners:
        self._plate_seq += 1
        noise = self._next_noise()
        corners = tuple(value + noise[k] + sag_px[k % 2] for k, value in enumerate(self._plate))
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
            noise = self._settings.sigma_px * self._rng.standard_normal((_NOISE_BLOCK, 8))
            self._noise, self._stray_px = noise.tolist(), abs(self._settings.sag_px) + float(np.abs(noise).max())
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


def _tipped(pose: Placed) -> bool:
    """Returns true if the mark would look foreshortened."""
    _, qx, qy, _ = pose.quaternion
    return 1.0 - 2.0 * (qx**2 + qy**2) < _TIPPED_COSINE


def _fiducial(geometry: CameraGeometry, centre_m: tuple[float, float], *, side_m: float) -> tuple[float, ...]:
    on_plate = replace(geometry, mark_height_m=0.0)
    corners = [(centre_m[0] + 0.5 * side_m * sx, centre_m[1] + 0.5 * side_m * sy) for sx, sy in _CORNER_SIGNS]
    return tuple(float(value) for value in pixels_of_mark(corners, on_plate).ravel())
