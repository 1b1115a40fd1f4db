"""How the camera sees the block's mark: what an effect needs that displaces its picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from shared.geometry import mark_corners
from shared.messages import CameraGeometry
from station.physics.contact import Array, View

if TYPE_CHECKING:
    from station.diagnosis.observations.build import Recorded

IMAGE_PX = 600


def block_view(
    recorded: Recorded,
    pose: Array,
    *,
    velocity_m_s: Array,
    yaw_rate_rad_s: Array,
    tilt_rad: Array,
    down_rad: Array,
    rest_s: Array,
) -> View:
    """The mark of blocks at poses (n, 3); the other arguments are as in `View`.

    Without a geometry of the camera the block's own sides are taken for the mark.
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
        side_m=geometry.marker_side_m,
        camera_height_m=geometry.camera_height_m or 0.3,
        image_centre_m=np.array([geometry.camera_x_m, geometry.camera_y_m]),
        row_m=np.array([0.0, -1.0]),
        image_size_m=IMAGE_PX * geometry.mm_per_px * 1e-3 * _nearer(geometry),
    )


def _nearer(geometry: CameraGeometry) -> float:
    """The scale of the picture at the mark's height, in metres a pixel, over that on the plate."""
    height = geometry.camera_height_m
    return 1.0 - geometry.mark_height_m / height if height > geometry.mark_height_m else 1.0
