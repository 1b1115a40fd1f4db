"""The camera sees the corners of the block's mark and of one fiducial of the plate, in pixels.

It looks straight down at the plate's centre, as its calibration says: x right, y down, the plate's y up the image.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.proof.patch_world import places as at
from tests.proof.patch_world.world import Camera

Array = NDArray[np.float64]
Pair = tuple[float, float]
SIZE_PX = 600
CENTRE_PX = (SIZE_PX - 1) / 2
PX_PER_M = 6000.0
HEIGHT_M = 0.3
FOCAL_PX = PX_PER_M * HEIGHT_M
FIDUCIAL_M = (-0.042, 0.042)
FIDUCIAL_SIDE_M = 0.004
_READ_ROUNDS = 3
"""Each leaves 2 % of a row's error before it, at 0.1 m/s and 20 ms from the first row to the last."""
_CORNERS = ((-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0))
"""The corners in the order of a recording: clockwise in the image, from the upper left at yaw zero."""


@dataclass(frozen=True, slots=True)
class View:
    """The camera of a world before a mark of a side (m) at a height above the plate (m)."""

    camera: Camera
    mark_side_m: float
    mark_height_m: float

    def block(self, state: Array, *, azimuth: float, run: int) -> list[float]:
        """The mark's corners (8: x0 y0 … y3, px) for a state of the bench, without noise."""
        x, y, yaw = state[at.X], state[at.Y], state[at.YAW]
        cosine, sine, half = math.cos(yaw), math.sin(yaw), 0.5 * self.mark_side_m
        shift = self._shift(state[at.ANGLE], azimuth=azimuth, run=run)
        seen: list[float] = []
        for bx, by in _CORNERS:
            rx, ry = half * (cosine * bx - sine * by), half * (sine * bx + cosine * by)
            spin, turning = state[at.SPIN], state[at.TURNING]
            velocity = state[at.VX] - spin * ry, state[at.VY] + spin * rx
            gaining = state[at.AX] - turning * ry - spin * spin * rx, state[at.AY] + turning * rx - spin * spin * ry
            seen += self._read((x + rx, y + ry), velocity, gaining, shift)
        return seen

    def fiducial(self, state: Array, *, azimuth: float, run: int) -> list[float]:
        """The fiducial's corners (8, px), without noise."""
        shift = self._shift(state[at.ANGLE], azimuth=azimuth, run=run)
        half = 0.5 * FIDUCIAL_SIDE_M
        seen: list[float] = []
        for bx, by in _CORNERS:
            seen += self._pixel(FIDUCIAL_M[0] + half * bx, FIDUCIAL_M[1] + half * by, 0.0, shift)
        return seen

    def _read(self, place: Pair, velocity: Pair, gaining: Pair, shift: Pair) -> Pair:
        """A moving corner's image: the row in which it stands when that row is read out.

        Without what it gains in speed meanwhile, it would stand up to 8 % of its way short at 0.05 m/s and 4 ms.
        """
        corner = self._pixel(*place, self.mark_height_m, shift)
        for _ in range(_READ_ROUNDS if self.camera.readout_s else 0):
            late = self.camera.readout_s * (corner[1] / SIZE_PX - 0.5)
            x, y = (
                at + late * (speed + 0.5 * late * gain)
                for at, speed, gain in zip(place, velocity, gaining, strict=True)
            )
            corner = self._pixel(x, y, self.mark_height_m, shift)
        return corner

    def _shift(self, angle: float, *, azimuth: float, run: int) -> tuple[float, float]:
        """The picture's shift (px): the mast bends with the plate's tilt, and the mount slips at some run."""
        camera = self.camera
        bend = camera.bend_px * math.sin(angle)
        towards = azimuth - 0.5 * math.pi if camera.bend_along else camera.bend_axis
        dx, dy = bend * math.cos(towards), -bend * math.sin(towards)
        return (dx + camera.slip_x_px, dy + camera.slip_y_px) if run >= camera.slip_run else (dx, dy)

    def _pixel(self, x: float, y: float, height: float, shift: tuple[float, float]) -> tuple[float, float]:
        scale = PX_PER_M * HEIGHT_M / (HEIGHT_M - height)
        u, v = scale * x, -scale * y
        if self.camera.radial:
            stretch = 1 + self.camera.radial * (u * u + v * v) / FOCAL_PX**2
            u, v = u * stretch, v * stretch
        return CENTRE_PX + u + shift[0], CENTRE_PX + v + shift[1]
