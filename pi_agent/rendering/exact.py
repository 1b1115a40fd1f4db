"""Frames with known corners, as true to the optics as the tests need: 0.005 px is resolved."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pi_agent.rendering.light import Frame, expose, illumination, tone_table
from pi_agent.rendering.painting import (
    EXACT,
    Coat,
    Patch,
    Quality,
    blur,
    exposure_instants,
    mark_coat,
    paint,
    patch_around,
    plate_patch,
)
from pi_agent.rendering.projection import collect_edges, corners_px, project
from pi_agent.rendering.scene import FRAME_PX, Pose, Scene

Image = NDArray[np.float32]
Floats = NDArray[np.float64]
Shift = tuple[float, float]

WHOLE_FRAME = Patch(0, 0, FRAME_PX, FRAME_PX)
NO_SHIFT: Shift = (0.0, 0.0)
QUICK_BASE = Quality(fine=1, instants=1)


def render(scene: Scene, pose: Pose, *, rng: np.random.Generator, sag_px: Shift = NO_SHIFT) -> tuple[Frame, Floats]:
    """Returns one frame (600, 600) uint8 and its true corners (4, 2), each at its own row's time.

    `sag_px`: the whole image's shift, camera sag, as (x, y).
    """
    return ExactRenderer(scene).render(pose, rng=rng, sag_px=sag_px)


class ExactRenderer:
    """Renders many frames of one scene; what does not move is painted once for each sag, and all once for each pose."""

    def __init__(self, scene: Scene, *, quality: Quality = EXACT) -> None:
        self.scene = scene
        self.quality = quality
        self._gain, self._glare = illumination(scene)
        self._table = tone_table(scene.sensor)
        self._ground_of: tuple[Shift, Image] | None = None
        self._painted_at: tuple[Pose | None, Shift, Image] | None = None

    def in_scene(self, scene: Scene) -> "ExactRenderer":
        """Returns a renderer of another scene.

        What this one has painted is not painted anew where only the light differs.
        """
        other = ExactRenderer(scene, quality=self.quality)
        relit = replace(scene, light=self.scene.light, glare=self.scene.glare, shadows=self.scene.shadows)
        if scene.plate is self.scene.plate and relit == self.scene:
            other._ground_of, other._painted_at = self._ground_of, self._painted_at
        return other

    def render(self, pose: Pose, *, rng: np.random.Generator, sag_px: Shift = NO_SHIFT) -> tuple[Frame, Floats]:
        """Returns the frame (FRAME_PX, FRAME_PX), pixel values, at the pose and the true corners (4, 2), px.

        See `render`.
        """
        normal = rng.standard_normal((FRAME_PX, FRAME_PX), dtype=np.float32)
        frame = expose(self.light(pose, sag_px=sag_px), normal, sensor=self.scene.sensor, table=self._table)
        return frame, corners_px(self.scene, pose, sag_px=sag_px)

    def light(self, pose: Pose | None, *, sag_px: Shift = NO_SHIFT) -> Image:
        """Returns light (FRAME_PX, FRAME_PX) on the sensor, 1 at full scale, without noise.

        It is without the block if `pose` is None.
        """
        return self._painted(pose, sag_px) * self._gain + self._glare

    def _painted(self, pose: Pose | None, sag_px: Shift) -> Image:
        if self._painted_at is None or self._painted_at[:2] != (pose, sag_px):
            image = self._ground(sag_px).copy()
            if pose is not None:
                self._paint_block(image, pose, sag_px)
            self._painted_at = (pose, sag_px, image)
        return self._painted_at[2]

    def _paint_block(self, image: Image, pose: Pose, sag_px: Shift) -> None:
        scene = self.scene
        times = scene.shutter.dt_s(np.array([0.0, FRAME_PX]))
        reach = project(scene.mark.outline_mm(), pose, optics=scene.optics, height_mm=scene.mark_height_mm, dt_s=times)
        blur_px = scene.optics.blur_px
        patch = patch_around(reach + np.asarray(sag_px), margin=6 + int(np.ceil(4 * blur_px)))
        coat = mark_coat(scene, scene.mark, pose, height_mm=scene.mark_height_mm)
        coats = (*still_coats(scene), coat, *occluder_coats(scene))
        ground = plate_patch(scene.plate, patch, sag_px=sag_px)
        instants = exposure_instants(scene, pose, quality=self.quality)
        painted = paint(ground, coats, scene=scene, patch=patch, instants=instants, quality=self.quality, sag_px=sag_px)
        image[patch.inside] = painted[patch.own_inside]

    def _ground(self, sag_px: Shift) -> Image:
        if self._ground_of is None or self._ground_of[0] != sag_px:
            self._ground_of = (sag_px, still_image(self.scene, sag_px=sag_px, quality=self.quality))
        return self._ground_of[1]


def still_coats(scene: Scene) -> tuple[Coat, ...]:
    """Returns the plate's fiducials and clutter, in the order of painting."""
    fiducials = tuple(
        mark_coat(scene, spot.mark, Pose(spot.x_mm, spot.y_mm, spot.yaw_rad), height_mm=0.0) for spot in scene.fiducials
    )
    return (*fiducials, Coat(collect_edges(scene.clutter))) if scene.clutter else fiducials


def occluder_coats(scene: Scene) -> tuple[Coat, ...]:
    """Returns the things that lie over the block."""
    return (Coat(collect_edges(scene.occluders)),) if scene.occluders else ()


def still_image(scene: Scene, *, sag_px: Shift, quality: Quality) -> Image:
    """Returns the reflectance (FRAME_PX, FRAME_PX) of all that does not move, through the lens."""
    ground = plate_patch(scene.plate, WHOLE_FRAME, sag_px=sag_px)
    coats = (*still_coats(scene), *occluder_coats(scene))
    still = np.zeros(1)
    if not coats:
        return blur(ground, scene.optics.blur_px).copy()
    if scene.clutter or scene.occluders:
        image = paint(ground, coats, scene=scene, patch=WHOLE_FRAME, instants=still, quality=QUICK_BASE, sag_px=sag_px)
    else:
        image = blur(ground, scene.optics.blur_px).copy()
    for spot in scene.fiducials:
        place = Pose(spot.x_mm, spot.y_mm, spot.yaw_rad)
        outline = project(spot.mark.outline_mm(), place, optics=scene.optics, height_mm=0.0) + np.asarray(sag_px)
        patch = patch_around(outline, margin=6)
        texture = plate_patch(scene.plate, patch, sag_px=sag_px)
        painted = paint(texture, coats, scene=scene, patch=patch, instants=still, quality=quality, sag_px=sag_px)
        image[patch.inside] = painted[patch.own_inside]
    return image
