"""Paints moving layers over a patch of the plate, with the sensor's rows each at their own time."""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from pi_agent.rendering.coverage import polygon_coverage
from pi_agent.rendering.marks import Ink, mark_layers
from pi_agent.rendering.plates import PAD_PX, Plate
from pi_agent.rendering.projection import EDGE_CUTS, Edges, collect_edges, project
from pi_agent.rendering.scene import FRAME_PX, Pose, Scene
from pi_agent.tracking.mark import Mark

Image = NDArray[np.float32]
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Patch:
    """A rectangle of whole pixels, in the frame's coordinates; it may reach beyond the frame by PAD_PX."""

    left: int
    top: int
    width: int
    height: int

    @property
    def inside(self) -> tuple[slice, slice]:
        """The frame's rows and columns that the patch covers."""
        rows = slice(max(self.top, 0), max(min(self.top + self.height, FRAME_PX), 0))
        return rows, slice(max(self.left, 0), max(min(self.left + self.width, FRAME_PX), 0))

    @property
    def own_inside(self) -> tuple[slice, slice]:
        """The same pixels, counted in the patch."""
        rows, columns = self.inside
        return (
            slice(rows.start - self.top, max(rows.stop - self.top, rows.start - self.top)),
            slice(columns.start - self.left, max(columns.stop - self.left, columns.start - self.left)),
        )


@dataclass(frozen=True)
class Coat:
    """Edges that move together: in a mark's frame at a pose (mm), or in the image itself (px; no pose)."""

    edges: Edges
    pose: Pose | None = None
    height_mm: float = 0.0

    def seen(self, scene: Scene, rows: Floats, instant_s: float) -> tuple[Floats, Floats]:
        """Ends of the edges in the image, px, (rows or 1, edges, 2), each row at its own time plus `instant_s`.

        `rows` (n,), px, are the rows' places in the frame.
        """
        if self.pose is None:
            return self.edges.starts[None], self.edges.ends[None]
        times = scene.shutter.dt_s(rows) + instant_s
        if self.pose.is_still or scene.shutter.line_ns == 0:
            times = times[:1]
        points = np.concatenate([self.edges.starts, self.edges.ends])
        views = project(points, self.pose, optics=scene.optics, height_mm=self.height_mm, dt_s=times)
        return views[:, : len(self.edges.starts)], views[:, len(self.edges.starts) :]


def mark_coat(scene: Scene, mark: Mark, pose: Pose, *, height_mm: float) -> Coat:
    """Returns a mark at a pose, ready to be painted."""
    return Coat(_mark_edges(mark, scene.ink, scene.optics.radial != 0), pose, height_mm)


@lru_cache(maxsize=16)
def _mark_edges(mark: Mark, ink: Ink, bent: bool) -> Edges:
    return collect_edges(mark_layers(mark, ink), cuts=EDGE_CUTS if bent else 1)


@dataclass(frozen=True)
class Quality:
    """The resolution with which a picture is painted.

    `fine`: sub-pixels a pixel and axis; `instants`: at most so many points in time within an exposure, `step_px` of
    motion from one to the next.
    """

    fine: int = 4
    instants: int = 17
    step_px: float = 0.25


EXACT = Quality()
FAST = Quality(fine=1, instants=4, step_px=1.2)
FAST_AT_REST = Quality(fine=2, instants=1)
"""Sub-pixels of a picture: with none an edge along the rows is no blurred step, and its corners are 0.03 px off."""


def patch_around(points: Floats, *, margin: int) -> Patch:
    """Returns the whole pixels around the points (…, 2), `margin` more on every side, within the padded frame."""
    flat = points.reshape(-1, 2)
    low = np.clip(np.floor(flat.min(axis=0)).astype(int) - margin, -PAD_PX, FRAME_PX + PAD_PX - 1)
    high = np.clip(np.ceil(flat.max(axis=0)).astype(int) + margin + 1, low + 1, FRAME_PX + PAD_PX)
    return Patch(int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1]))


def exposure_instants(scene: Scene, pose: Pose, *, quality: Quality) -> Floats:
    """Gives times (k,), s about the middle of the exposure, of the images that are averaged: one for a still block."""
    if pose.is_still or scene.shutter.exposure_ns == 0:
        return np.zeros(1)
    exposure_s = scene.shutter.exposure_ns * 1e-9
    # At the capture time, and what is gained by the row that is exposed furthest from it.
    apart_s = float(np.abs(scene.shutter.dt_s((0, FRAME_PX))).max())
    gain_mm_s2 = np.hypot(*pose.gain[:2]) + abs(pose.gain[2]) * scene.mark.side_mm
    speed_mm_s = np.hypot(pose.vx_mm_s, pose.vy_mm_s) + abs(pose.yaw_rate_rad_s) * scene.mark.side_mm
    speed_mm_s += gain_mm_s2 * apart_s
    path_px = float(speed_mm_s) * exposure_s * scene.optics.px_per_mm
    count = int(np.clip(np.ceil(path_px / quality.step_px), 1, quality.instants))
    return ((np.arange(count) + 0.5) / count - 0.5) * exposure_s


def fast_quality(instants: Floats) -> Quality:
    """Returns the resolution of a live picture: with sub-pixels where no motion within the exposure blurs it.

    `instants` (k,), s, are those of `exposure_instants`.
    """
    return FAST if len(instants) > 1 else FAST_AT_REST


def paint(
    ground: Image,
    coats: tuple[Coat, ...],
    *,
    scene: Scene,
    patch: Patch,
    instants: Floats,
    quality: Quality,
    sag_px: tuple[float, float] = (0.0, 0.0),
) -> Image:
    """Returns the coats over `ground` (height, width), reflectance, blurred by the lens.

    The result is as large as the patch.

    Args:
        ground: (height, width) the ground's reflectance, not blurred, as large as the patch.
        coats: what is painted over the ground, in this order.
        scene: where everything is.
        patch: the part of the frame that is painted.
        instants: (k,) the points in time whose images are averaged, s about the middle of the exposure.
        quality: the resolution of the picture.
        sag_px: how far the picture is shifted by a camera that sags, x and y, px.
    """
    fine = quality.fine
    base = np.repeat(np.repeat(ground, fine, axis=0), fine, axis=1) if fine > 1 else ground
    views = [
        _paint_instant(base, coats, scene=scene, patch=patch, instant_s=float(instant), fine=fine, sag_px=sag_px)
        for instant in instants
    ]
    mean = views[0] if len(views) == 1 else np.asarray(np.mean(views, axis=0), dtype=np.float32)
    return shrink(blur(mean, scene.optics.blur_px * fine), fine)


def _paint_instant(
    base: Image,
    coats: tuple[Coat, ...],
    *,
    scene: Scene,
    patch: Patch,
    instant_s: float,
    fine: int,
    sag_px: tuple[float, float],
) -> Image:
    """Paints one point in time: all coats' edges go through one accumulation.

    Layers that lie elsewhere are left out.
    """
    rows = patch.top + (np.arange(patch.height * fine) + 0.5) / fine - 0.5
    origin = np.array([patch.left - 0.5, patch.top - 0.5]) - np.asarray(sag_px)
    seen = [coat.seen(scene, rows, instant_s) for coat in coats]
    times = max(len(ends[0]) for ends in seen)
    starts, ends = (
        np.concatenate([np.broadcast_to(part[side], (times, *part[side].shape[1:])) for part in seen], axis=1) - origin
        for side in (0, 1)
    )
    first = np.cumsum([0] + [len(coat.edges.reflectances) for coat in coats])
    layer = np.concatenate([coat.edges.layer + begin for coat, begin in zip(coats, first, strict=False)])
    reflectances = np.array([r for coat in coats for r in coat.edges.reflectances])
    kept = _within(starts, layer, layers=int(first[-1]), size=(patch.width, patch.height))
    own, number = kept[layer], np.cumsum(kept) - 1
    shape = (patch.height * fine, patch.width * fine)
    covered = polygon_coverage(
        starts[:, own] * fine, ends[:, own] * fine, number[layer[own]], layers=int(kept.sum()), shape=shape
    )
    return composite(base, covered, tuple(reflectances[kept].tolist()))


def _within(starts: Floats, layer: NDArray[np.int64], *, layers: int, size: tuple[int, int]) -> NDArray[np.bool_]:
    """Gives the layers (layers,) with a polygon that may reach into a patch of `size`, by the box around each layer."""
    low, high = np.full((layers, 2), np.inf), np.full((layers, 2), -np.inf)
    np.minimum.at(low, layer, starts.min(axis=0))
    np.maximum.at(high, layer, starts.max(axis=0))
    return np.all((high > 0.0) & (low < np.asarray(size)), axis=1)


def composite(base: Image, covered: NDArray[np.float32], reflectances: tuple[float, ...]) -> Image:
    """Returns the layers painted one after another over `base` (height, width), reflectance, in the same shape.

    Args:
        base: (height, width) what is painted over, reflectance.
        covered: (layers, height, width) the share of each pixel that each layer covers, 0 to 1.
        reflectances: the reflectance of each layer.
    """
    image = base
    for cover, reflectance in zip(covered, reflectances, strict=True):
        image = image + cover * (np.float32(reflectance) - image)
    return image


def blur(image: Image, sigma: float) -> Image:
    """Spreads light as the lens does, by a Gaussian, in `image` (h, w), reflectance, in the same shape.

    It does nothing at `sigma` 0 px.
    """
    if sigma <= 0:
        return image
    size = 2 * int(np.ceil(4 * sigma)) + 1
    return np.asarray(cv2.GaussianBlur(image, (size, size), sigma, borderType=cv2.BORDER_REPLICATE), dtype=np.float32)


def shrink(image: Image, fine: int) -> Image:
    """Gives the sensor's pixels (h / fine, w / fine), as means of sub-pixels of `image` (h, w), in the unit of that."""
    if fine == 1:
        return image
    rows, columns = image.shape[0] // fine, image.shape[1] // fine
    return image.reshape(rows, fine, columns, fine).mean(axis=(1, 3), dtype=np.float32)


def plate_patch(plate: Plate, patch: Patch, *, sag_px: tuple[float, float]) -> Image:
    """Returns the plate's own reflectance (h, w) under the patch, moved by whole and by fractions of a pixel.

    `plate` (height, width), reflectance, begins PAD_PX before the frame.
    """
    x = patch.left + PAD_PX - sag_px[0]
    y = patch.top + PAD_PX - sag_px[1]
    moved = np.array([[1.0, 0.0, x], [0.0, 1.0, y]])
    flags = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
    if float(x).is_integer() and float(y).is_integer():
        left, top = int(x), int(y)
        inside = (
            left >= 0 and top >= 0 and left + patch.width <= plate.shape[1] and top + patch.height <= plate.shape[0]
        )
        if inside:
            return plate[top : top + patch.height, left : left + patch.width]
    size = (patch.width, patch.height)
    return np.asarray(
        cv2.warpAffine(plate, moved, size, flags=flags, borderMode=cv2.BORDER_REFLECT_101), dtype=np.float32
    )
