"""The camera's view of the block's mark and of the plate's fiducials, from which effects compute its displacement."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from shared.geometry import apply_homography, mark_corners, mark_scale
from shared.messages import CameraGeometry
from station.physics.contact import Array, View

if TYPE_CHECKING:
    from station.diagnosis.observations.build import Recorded


def block_view(
    recorded: Recorded,
    pose: Array,
    *,
    velocity_m_s: Array,
    yaw_rate_rad_s: Array,
    tilt_rad: Array,
    down_rad: Array,
    rest_s: Array,
    limit_rad: Array | None = None,
) -> View:
    """Returns the view of the mark on blocks; the arguments but the first two are those of `View`.

    Without the camera's geometry the mark is taken to be as large as the block.

    Args:
        recorded: the recording, with the camera's geometry.
        pose: (n, 3) x and y (m) and yaw (rad) of the blocks in P.
        velocity_m_s: (n, 2) velocity of the mark's centre in P, m/s.
        yaw_rate_rad_s: (n,) turning rate of the mark, rad/s.
        tilt_rad: (n,) angle between the plate's normal and up, rad.
        down_rad: (n,) direction of the steepest descent in P, rad.
        rest_s: (n,) time since the run's tilt began, s.
        limit_rad: (n,) tilt at which the run's block slid, rad; None where it is not asked for.
    """
    geometry = recorded.signals.geometry or CameraGeometry(
        marker_side_m=recorded.setting.block_side_m, mm_per_px=0.1667
    )
    cosine, sine = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    mark = mark_corners(side_m=geometry.marker_side_m, aspect=geometry.marker_aspect)
    turned = np.stack(
        [
            np.outer(cosine, mark[:, 0]) - np.outer(sine, mark[:, 1]),
            np.outer(sine, mark[:, 0]) + np.outer(cosine, mark[:, 1]),
        ],
        axis=-1,
    )
    return View(
        point_m=turned + pose[:, None, :2],
        on_block=True,
        velocity_m_s=velocity_m_s,
        yaw_rate_rad_s=yaw_rate_rad_s,
        tilt_rad=tilt_rad,
        down_rad=down_rad,
        rest_s=rest_s,
        limit_rad=np.full(len(pose), np.nan) if limit_rad is None else limit_rad,
        **_camera(geometry, recorded.setting.image_height_px, nearer=_nearer(geometry)),
    )


def fixed_view(
    point_m: Array, geometry: CameraGeometry, *, image_height_px: int, tilt_rad: Array, down_rad: Array
) -> View:
    """Returns the view of a fiducial that is fixed to the plate.

    Args:
        point_m: (n, 4, 2) its corners in P, m.
        geometry: the camera's geometry.
        image_height_px: the picture's height, px.
        tilt_rad: (n,) the plate's tilt as in `View`, rad.
        down_rad: (n,) the direction of the steepest descent as in `View`, rad.
    """
    count = len(point_m)
    return View(
        point_m=point_m,
        on_block=False,
        velocity_m_s=np.zeros((count, 2)),
        yaw_rate_rad_s=np.zeros(count),
        tilt_rad=tilt_rad,
        down_rad=down_rad,
        rest_s=np.zeros(count),
        limit_rad=np.full(count, np.nan),
        **_camera(geometry, image_height_px),
    )


def _camera(geometry: CameraGeometry, image_height_px: int, *, nearer: float = 1.0) -> dict[str, Any]:
    """Gives the fields of `View` that are the camera's own; the picture's scale is `nearer` times that on the plate."""
    row_m = _row_m(geometry)
    length_m = float(np.linalg.norm(row_m))
    return {
        "side_m": geometry.marker_side_m,
        "camera_height_m": geometry.camera_height_m or 0.3,
        "image_centre_m": np.array([geometry.camera_x_m, geometry.camera_y_m]),
        "row_m": row_m / length_m,
        "image_size_m": image_height_px * length_m * nearer,
    }


def _row_m(geometry: CameraGeometry) -> Array:
    """Gives the way (2,), m, on the plate from a row of the picture to the next, if the camera looks straight down."""
    if not geometry.plate_from_pixel:
        return np.array([0.0, -1e-3 * geometry.mm_per_px])
    homography = np.reshape(geometry.plate_from_pixel, (3, 3))
    below_px = apply_homography(np.linalg.inv(homography), np.array([[geometry.camera_x_m, geometry.camera_y_m]]))
    first, second = apply_homography(homography, np.add(below_px, [[0.0, 0.0], [0.0, 1.0]]))
    return second - first


def _nearer(geometry: CameraGeometry) -> float:
    """Returns the ratio of the picture's scale, m a pixel, at the mark's height to that on the plate."""
    return mark_scale(geometry) if geometry.camera_height_m > geometry.mark_height_m else 1.0
