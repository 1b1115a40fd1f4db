"""The expected frame about a mark, in pixel values without noise, as the mark's corners, the blur or the plate change.

It is painted by the renderer's own parts, so that its derivatives are those of the frames that the trackers see.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pi_agent.rendering import Layer, Pose, Scene
from pi_agent.rendering.exact import occluder_coats, still_coats
from pi_agent.rendering.light import illumination
from pi_agent.rendering.marks import mark_layers
from pi_agent.rendering.painting import (
    Coat,
    Patch,
    Quality,
    exposure_instants,
    paint,
    patch_around,
    plate_patch,
)
from pi_agent.rendering.projection import EDGE_CUTS, collect_edges, corners_px, project
from pi_agent.rendering.scene import FRAME_PX
from pi_agent.tracking.mark import Mark

Floats = NDArray[np.float64]
Image = NDArray[np.float32]

QUALITY = Quality(fine=2, instants=7, step_px=0.6)
STEP_MM = 0.004  # step of a corner: 0.024 px, small beside the blur and large beside the rounding of the painted light


@dataclass(frozen=True)
class MovedMark(Mark):
    """A mark whose dark square has its corners elsewhere; for where they are seen."""

    moved_mm: tuple[tuple[float, float], ...] = ()

    def corners_mm(self) -> Floats:
        """The four corners (4, 2)."""
        return np.array(self.moved_mm)


class ExpectedFrame:
    """The patch of a frame about its mark.

    `patch`: the pixels that are painted; `gain`, `glare`: the illumination there. The methods give light (1 = full
    scale) of the patch; `values` turns light into pixel values that are not rounded.
    """

    def __init__(self, scene: Scene, pose: Pose, *, quality: Quality = QUALITY) -> None:
        self.scene, self.pose, self.quality = scene, pose, quality
        self.corners_mm = scene.mark.corners_mm()
        times = scene.shutter.dt_s(np.array([0.0, FRAME_PX]))
        reach = project(scene.mark.outline_mm(), pose, optics=scene.optics, height_mm=scene.mark_height_mm, dt_s=times)
        around = patch_around(reach, margin=6 + int(np.ceil(4 * scene.optics.blur_px)))
        rows, columns = around.inside
        self.patch = Patch(columns.start, rows.start, columns.stop - columns.start, rows.stop - rows.start)
        self.gain, self.glare = (image[self.patch.inside] for image in illumination(scene))
        self.ground = plate_patch(scene.plate, self.patch, sag_px=(0.0, 0.0))
        self.instants = exposure_instants(scene, pose, quality=quality)

    def reflectance(
        self,
        corners_mm: Floats | None = None,
        *,
        with_feature: bool = True,
        blur_px: float | None = None,
        ground: Image | None = None,
    ) -> Image:
        """Reflectance through the lens.

        `corners_mm`: of the dark square (4, 2), `with_feature`: what is printed inside goes along; `ground`: another
        plate. The outside of a margin stays where it is: it is cut by hand, and no method may lean on it.
        """
        optics = replace(self.scene.optics, blur_px=self.scene.optics.blur_px if blur_px is None else blur_px)
        scene = replace(self.scene, optics=optics)
        coats = (*still_coats(scene), self._coat(corners_mm, with_feature=with_feature), *occluder_coats(scene))
        base = self.ground if ground is None else ground
        return paint(base, coats, scene=scene, patch=self.patch, instants=self.instants, quality=self.quality)

    def values(self, light: Image) -> Floats:
        """Pixel values of light, not rounded."""
        return np.asarray(
            self.scene.sensor.tone.to_value(np.clip(light, 0.0, 1.0).astype(np.float32)), dtype=np.float64
        )

    def seen_px(self, corners_mm: Floats) -> Floats:
        """Returns the pixels (4, 2) of corners of the mark's frame (4, 2), mm, each seen at the time of its own row."""
        mark = self.scene.mark
        moved = MovedMark(mark.side_mm, mark.aspect, moved_mm=tuple(map(tuple, corners_mm.tolist())))
        return corners_px(replace(self.scene, mark=moved), self.pose)

    def _coat(self, corners_mm: Floats | None, *, with_feature: bool) -> Coat:
        layers = mark_layers(self.scene.mark, self.scene.ink)
        if corners_mm is not None:
            moves = homography(self.corners_mm, corners_mm)
            square = 1 if self.scene.mark.margin > 0 else 0
            going = range(square, len(layers) if with_feature else square + 1)
            layers = tuple(_moved(layer, moves) if n in going else layer for n, layer in enumerate(layers))
        cuts = EDGE_CUTS if self.scene.optics.radial != 0 else 1
        return Coat(collect_edges(layers, cuts=cuts), self.pose, self.scene.mark_height_mm)


def homography(start: Floats, end: Floats) -> Floats:
    """The projective map (3, 3) that takes four points (4, 2) to four others."""
    rows, wanted = [], []
    for (x, y), (u, v) in zip(start, end, strict=True):
        rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y], [0, 0, 0, x, y, 1, -v * x, -v * y]]
        wanted += [u, v]
    return np.append(np.linalg.solve(np.array(rows), np.array(wanted)), 1.0).reshape(3, 3)


def _moved(layer: Layer, by: Floats) -> Layer:
    polygons = []
    for polygon in layer.polygons:
        points = np.column_stack([polygon, np.ones(len(polygon))]) @ by.T
        polygons.append(points[:, :2] / points[:, 2:])
    return Layer(tuple(polygons), layer.reflectance)
