"""The camera's view of simulated blocks: corners in pixels, displaced by the effects on the image."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from shared.geometry import apply_homography, mark_corners, pixels_of_mark
from shared.messages import CameraGeometry
from station.physics.contact import Array, Bools, View
from station.physics.model import Model


@dataclass(frozen=True, eq=False, kw_only=True)
class Seen:
    """Moments of a mark: `pose`, `velocity` (n, 3) x, y, yaw in P; the others (n,) are those of `View`."""

    pose: Array
    velocity: Array
    tilt_rad: Array
    down_rad: Array
    rest_s: Array
    limit_rad: Array


class Camera:
    """The recorded camera, with the displacements of a model."""

    def __init__(self, geometry: CameraGeometry, *, size_px: tuple[int, int]) -> None:
        self.geometry, self.size_px = geometry, size_px
        self.flat = replace(geometry, mark_height_m=0.0)
        """The calibration for what lies in the plate's own plane."""
        self._centre = np.array([geometry.camera_x_m, geometry.camera_y_m])
        homography = np.reshape(geometry.plate_from_pixel, (3, 3))
        middle = np.array([0.5 * (size_px[0] - 1), 0.5 * (size_px[1] - 1)])
        ends = apply_homography(homography, np.array([middle, [middle[0], middle[1] + 1.0]]))
        down = ends[1] - ends[0]
        self._row, self._row_m = down / np.linalg.norm(down), float(np.linalg.norm(down))
        self._mark = mark_corners(side_m=geometry.marker_side_m, aspect=geometry.marker_aspect)

    def block_px(self, seen: Seen, model: Model) -> Array:
        """Returns the corners (n, 4, 2) of the block's mark, pixels."""
        cosine, sine = np.cos(seen.pose[:, 2]), np.sin(seen.pose[:, 2])
        turn = np.stack([np.stack([cosine, -sine], axis=-1), np.stack([sine, cosine], axis=-1)], axis=-2)
        corners = seen.pose[:, None, :2] + np.einsum("nij,kj->nki", turn, self._mark)
        return self._pixels(corners, seen, model, on_block=True)

    def fiducial_px(self, corners_m: Array, seen: Seen, model: Model) -> Array:
        """Returns a mark `corners_m` (4, 2), m, that is fixed to the plate at every moment: (n, 4, 2) pixels."""
        everywhere = np.broadcast_to(corners_m, (len(seen.tilt_rad), 4, 2))
        return self._pixels(everywhere, seen, model, on_block=False)

    def inside(self, corner_px: Array) -> Bools:
        """Returns true (n,) if all corners `corner_px` (n, 4, 2), px, are in the picture."""
        limit = np.array(self.size_px, dtype=float)
        return np.all((corner_px >= 0.0) & (corner_px < limit), axis=(1, 2), keepdims=True)[:, 0, 0]

    def _pixels(self, corners_m: Array, seen: Seen, model: Model, *, on_block: bool) -> Array:
        if model.acting("seen"):
            corners_m = corners_m + model.seen(self._view(corners_m, seen, on_block=on_block))
        geometry = self.geometry if on_block else self.flat
        return pixels_of_mark(corners_m.reshape(-1, 2), geometry).reshape(-1, 4, 2)

    def _view(self, corners_m: Array, seen: Seen, *, on_block: bool) -> View:
        return View(
            point_m=corners_m,
            on_block=on_block,
            velocity_m_s=seen.velocity[:, :2] if on_block else np.zeros((len(corners_m), 2)),
            yaw_rate_rad_s=seen.velocity[:, 2] if on_block else np.zeros(len(corners_m)),
            tilt_rad=seen.tilt_rad,
            down_rad=seen.down_rad,
            rest_s=seen.rest_s,
            limit_rad=seen.limit_rad,
            side_m=self.geometry.marker_side_m,
            camera_height_m=self.geometry.camera_height_m,
            image_centre_m=self._centre,
            row_m=self._row,
            image_size_m=self._row_m * self.size_px[1],
        )
