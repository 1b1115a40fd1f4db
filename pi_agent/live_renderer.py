"""Draws the synthetic camera's frames while its mount gives way: as fast when the picture moves as when it rests.

`FastRenderer` paints its whole bank of plates anew when the picture moves, which takes longer than a frame. Here the
bank is wider than the frame: whole pixels of the movement are a choice of the part that is shown, and only the
fiducials are painted anew, for the one frame that is drawn.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pi_agent.cameras import Image
from pi_agent.rendering import Pose, Scene
from pi_agent.rendering.light import expose, illumination, tone_table
from pi_agent.rendering.painting import (
    FAST,
    Coat,
    Patch,
    Quality,
    blur,
    exposure_instants,
    fast_quality,
    mark_coat,
    paint,
    patch_around,
    plate_patch,
)
from pi_agent.rendering.projection import corners_px, project
from pi_agent.rendering.scene import FRAME_PX

Floats = NDArray[np.float64]
Light = NDArray[np.float32]
Shift = tuple[float, float]

BANK = 12
"""Plates with different noise, taken in random order."""
NOISE_PX = 1024
"""Side of the field of normal deviates that patches take their noise from."""
FIDUCIALS = Quality(fine=2, instants=1)
STILL_PX = 0.002
"""A smaller movement of the picture is not drawn: nobody could measure it."""
JUMP_PX = 0.1
"""While the picture creeps, one fiducial a frame is painted anew, the one farthest behind, so that a moving picture
costs little more than a resting one; one that is this far behind does not wait for its turn."""
FIDUCIAL_RIM_PX, BLOCK_RIM_PX = 5, 3


class LiveRenderer:
    """Frames (600, 600) of one scene without clutter or occluders, whose picture moves by at most `reach_px`.

    Takes its random numbers from the Generator. Memory: the bank, 5 MB, and 4 MB of noise.
    """

    def __init__(self, scene: Scene, *, rng: np.random.Generator, reach_px: float = 0.0) -> None:
        self.scene, self._rng = scene, rng
        self._gain, self._glare = illumination(scene)
        self._table = tone_table(scene.sensor)
        self._noise = rng.standard_normal((NOISE_PX, NOISE_PX), dtype=np.float32)
        self._rim = int(np.ceil(reach_px)) + 1
        self._bank = [self._plate(ground) for ground in [self._wide_ground()] * BANK]
        self._coats = [
            mark_coat(scene, spot.mark, Pose(spot.x_mm, spot.y_mm, spot.yaw_rad), height_mm=0.0)
            for spot in scene.fiducials
        ]
        self._outlines = [self._outline(index) for index in range(len(self._coats))]
        self._painted = [self._painted_fiducial(index, (0.0, 0.0)) for index in range(len(self._coats))]
        self._painted_for: list[Shift] = [(0.0, 0.0)] * len(self._coats)

    def render(self, pose: Pose | None, *, sag_px: Shift = (0.0, 0.0)) -> tuple[Image, Floats]:
        """Returns a new frame, its picture moved by (x, y), and the mark's true corners (4, 2; none without a pose)."""
        self._paint_fiducials(sag_px)
        left, top = self._rim - round(sag_px[0]), self._rim - round(sag_px[1])
        wide = self._bank[int(self._rng.integers(BANK))]
        frame = wide[top : top + FRAME_PX, left : left + FRAME_PX].copy()
        for patch, reflectance in self._painted:
            self._expose_into(frame, reflectance, patch)
        if pose is None:
            return frame, np.zeros((0, 2))
        self._paint_block(frame, pose, sag_px)
        return frame, corners_px(self.scene, pose, sag_px=sag_px)

    def _wide_ground(self) -> Light:
        """Returns the plate's own light, a rim wider than the frame on every side."""
        rim = self._rim
        patch = Patch(-rim, -rim, FRAME_PX + 2 * rim, FRAME_PX + 2 * rim)
        ground = blur(plate_patch(self.scene.plate, patch, sag_px=(0.0, 0.0)), self.scene.optics.blur_px)
        return ground * np.pad(self._gain, rim, mode="edge") + np.pad(self._glare, rim, mode="edge")

    def _plate(self, ground: Light) -> Image:
        normal = self._rng.standard_normal(ground.shape, dtype=np.float32)
        return expose(ground, normal, sensor=self.scene.sensor, table=self._table)

    def _outline(self, index: int) -> Floats:
        spot = self.scene.fiducials[index]
        where = Pose(spot.x_mm, spot.y_mm, spot.yaw_rad)
        return project(spot.mark.outline_mm(), where, optics=self.scene.optics, height_mm=0.0)[0]

    def _paint_fiducials(self, sag_px: Shift) -> None:
        """Keeps the fiducials up with the picture's movement."""
        behind = [max(abs(sag_px[0] - x), abs(sag_px[1] - y)) for x, y in self._painted_for]
        farthest = max(behind, default=0.0)
        for index, distance in enumerate(behind):
            if distance >= JUMP_PX or distance == farthest >= STILL_PX:
                self._painted[index] = self._painted_fiducial(index, sag_px)
                self._painted_for[index] = sag_px
                if farthest < JUMP_PX:
                    return

    def _painted_fiducial(self, index: int, sag_px: Shift) -> tuple[Patch, Light]:
        whole = (float(round(sag_px[0])), float(round(sag_px[1])))
        patch = patch_around(self._outlines[index] + np.asarray(sag_px), margin=FIDUCIAL_RIM_PX)
        ground = plate_patch(self.scene.plate, patch, sag_px=whole)
        coats, still = (self._coats[index],), np.zeros(1)
        return patch, paint(
            ground, coats, scene=self.scene, patch=patch, instants=still, quality=FIDUCIALS, sag_px=sag_px
        )

    def _paint_block(self, frame: Image, pose: Pose, sag_px: Shift) -> None:
        scene = self.scene
        times = scene.shutter.dt_s(np.array([0.0, FRAME_PX]))
        reach = project(scene.mark.outline_mm(), pose, optics=scene.optics, height_mm=scene.mark_height_mm, dt_s=times)
        margin = BLOCK_RIM_PX + int(np.ceil(3 * scene.optics.blur_px))
        patch = patch_around(reach + np.asarray(sag_px), margin=margin)
        rows, columns = patch.inside
        if rows.start >= rows.stop or columns.start >= columns.stop:
            return
        whole = (float(round(sag_px[0])), float(round(sag_px[1])))
        instants = exposure_instants(scene, pose, quality=FAST)
        light = paint(
            plate_patch(scene.plate, patch, sag_px=whole),
            (*self._coats_near(patch), mark_coat(scene, scene.mark, pose, height_mm=scene.mark_height_mm)),
            scene=scene,
            patch=patch,
            instants=instants,
            quality=fast_quality(instants),
            sag_px=sag_px,
        )
        self._expose_into(frame, light, patch)

    def _coats_near(self, patch: Patch) -> list[Coat]:
        """Returns the fiducials that the block's patch reaches: it is painted over them."""
        near: list[Coat] = []
        for coat, (fiducial, _) in zip(self._coats, self._painted, strict=True):
            apart_x = max(fiducial.left - patch.left - patch.width, patch.left - fiducial.left - fiducial.width)
            apart_y = max(fiducial.top - patch.top - patch.height, patch.top - fiducial.top - fiducial.height)
            if max(apart_x, apart_y) < 0:
                near.append(coat)
        return near

    def _expose_into(self, frame: Image, reflectance: Light, patch: Patch) -> None:
        own, inside = patch.own_inside, patch.inside
        light = reflectance[own] * self._gain[inside] + self._glare[inside]
        y, x = self._rng.integers(0, NOISE_PX - max(light.shape), size=2)
        normal = self._noise[y : y + light.shape[0], x : x + light.shape[1]]
        frame[inside] = expose(light, normal, sensor=self.scene.sensor, table=self._table)
