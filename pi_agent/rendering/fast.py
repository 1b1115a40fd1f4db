"""The synthetic camera's renderer: below a millisecond a frame, because only the block's patch is drawn anew.

The plate is fixed in the image: a small bank of noisy pictures of it is made once and taken in random order. When the
camera sags, the bank is made anew only where it matters (the fiducials, exactly); the texture follows by whole pixels.
"""

import numpy as np
from numpy.typing import NDArray

from pi_agent.rendering.exact import NO_SHIFT, Shift, occluder_coats, still_coats, still_image
from pi_agent.rendering.light import Frame, expose, illumination, tone_table
from pi_agent.rendering.painting import (
    EXACT,
    FAST,
    Coat,
    Patch,
    Quality,
    exposure_instants,
    fast_quality,
    mark_coat,
    paint,
    patch_around,
    plate_patch,
)
from pi_agent.rendering.projection import corners_px, project
from pi_agent.rendering.scene import FRAME_PX, Pose, Scene

Image = NDArray[np.float32]
Floats = NDArray[np.float64]

BANK = 12
NOISE_PX = 1024  # side of the field of normal deviates from which patches are cut
FIDUCIALS = Quality(fine=2, instants=1)
SAG_STEP_PX = 0.002  # a smaller change of the sag moves the fiducials less than can be measured


class FastRenderer:
    """Frames of one scene at 90 Hz and more.

    Takes its random numbers from the Generator given once. Memory: BANK frames of 360 kB and 4 MB of noise.
    """

    def __init__(self, scene: Scene, *, rng: np.random.Generator) -> None:
        self.scene = scene
        self._rng = rng
        self._gain, self._glare = illumination(scene)
        self._table = tone_table(scene.sensor)
        self._noise = rng.standard_normal((NOISE_PX, NOISE_PX), dtype=np.float32)
        self._sag: Shift = NO_SHIFT
        self._bank = self._frames(still_image(scene, sag_px=NO_SHIFT, quality=EXACT))

    def render(self, pose: Pose | None, *, sag_px: Shift = NO_SHIFT) -> tuple[Frame, Floats]:
        """Returns a new frame (600, 600) uint8 and the true corners (4, 2; empty without a pose)."""
        self._follow_sag(sag_px)
        frame = self._bank[int(self._rng.integers(len(self._bank)))].copy()
        if pose is None:
            return frame, np.zeros((0, 2))
        self._paint_block(frame, pose, sag_px)
        return frame, corners_px(self.scene, pose, sag_px=sag_px)

    def _paint_block(self, frame: Frame, pose: Pose, sag_px: Shift) -> None:
        scene = self.scene
        patch = self._block_patch(pose, sag_px)
        rows, columns = patch.inside
        if rows.start >= rows.stop or columns.start >= columns.stop:
            return
        coats = (*self._coats_near(patch), mark_coat(scene, scene.mark, pose, height_mm=scene.mark_height_mm))
        whole = (float(round(sag_px[0])), float(round(sag_px[1])))
        ground = plate_patch(scene.plate, patch, sag_px=whole)
        instants = exposure_instants(scene, pose, quality=FAST)
        painted = paint(
            ground,
            (*coats, *occluder_coats(scene)),
            scene=scene,
            patch=patch,
            instants=instants,
            quality=fast_quality(instants),
            sag_px=sag_px,
        )
        self._expose_into(frame, painted, patch)

    def _block_patch(self, pose: Pose, sag_px: Shift) -> Patch:
        scene = self.scene
        times = scene.shutter.dt_s(np.array([0.0, FRAME_PX]))
        reach = project(scene.mark.outline_mm(), pose, optics=scene.optics, height_mm=scene.mark_height_mm, dt_s=times)
        return patch_around(reach + np.asarray(sag_px), margin=3 + int(np.ceil(3 * scene.optics.blur_px)))

    def _coats_near(self, patch: Patch) -> tuple[Coat, ...]:
        """Returns clutter and fiducials, when the block is near enough for them to be seen in its patch."""
        if self.scene.clutter:
            return still_coats(self.scene)
        near = [
            coat
            for coat, spot in zip(still_coats(self.scene), self.scene.fiducials, strict=False)
            if self._touches(patch, spot.x_mm, spot.y_mm, 2.0 * spot.mark.side_mm)
        ]
        return tuple(near)

    def _touches(self, patch: Patch, x_mm: float, y_mm: float, reach_mm: float) -> bool:
        optics = self.scene.optics
        x, y = x_mm * optics.px_per_mm + optics.centre_px[0], y_mm * optics.px_per_mm + optics.centre_px[1]
        reach = reach_mm * optics.px_per_mm + 20.0
        return (
            patch.left - reach < x < patch.left + patch.width + reach
            and patch.top - reach < y < patch.top + patch.height + reach
        )

    def _expose_into(self, frame: Frame, reflectance: Image, patch: Patch) -> None:
        own, inside = patch.own_inside, patch.inside
        light = reflectance[own] * self._gain[inside] + self._glare[inside]
        y, x = self._rng.integers(0, NOISE_PX - max(light.shape), size=2)
        normal = self._noise[y : y + light.shape[0], x : x + light.shape[1]]
        frame[inside] = expose(light, normal, sensor=self.scene.sensor, table=self._table)

    def _follow_sag(self, sag_px: Shift) -> None:
        """Brings the bank to a new sag: texture by whole pixels, fiducials exactly."""
        if max(abs(sag_px[0] - self._sag[0]), abs(sag_px[1] - self._sag[1])) < SAG_STEP_PX:
            return
        if (round(sag_px[0]), round(sag_px[1])) != (round(self._sag[0]), round(self._sag[1])):
            self._bank = self._frames(still_image(self.scene, sag_px=sag_px, quality=FIDUCIALS))
        else:
            self._move_fiducials(sag_px)
        self._sag = sag_px

    def _move_fiducials(self, sag_px: Shift) -> None:
        scene = self.scene
        whole = (float(round(sag_px[0])), float(round(sag_px[1])))
        for coat, spot in zip(still_coats(scene), scene.fiducials, strict=False):
            place = Pose(spot.x_mm, spot.y_mm, spot.yaw_rad)
            outline = project(spot.mark.outline_mm(), place, optics=scene.optics, height_mm=0.0)
            patch = patch_around(outline + np.asarray(sag_px), margin=5)
            ground = plate_patch(scene.plate, patch, sag_px=whole)
            still = np.zeros(1)
            painted = paint(ground, (coat,), scene=scene, patch=patch, instants=still, quality=FIDUCIALS, sag_px=sag_px)
            for frame in self._bank:
                self._expose_into(frame, painted, patch)

    def _frames(self, reflectance: Image) -> list[Frame]:
        light = reflectance * self._gain + self._glare
        frames = []
        for _ in range(BANK):
            normal = self._rng.standard_normal(light.shape, dtype=np.float32)
            frames.append(expose(light, normal, sensor=self.scene.sensor, table=self._table))
        return frames
