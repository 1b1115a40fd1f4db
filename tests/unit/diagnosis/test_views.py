"""The camera of the evidence is the recording's own, however it is turned and however many rows it has."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from shared.geometry import pixels_of_mark
from shared.messages import CameraGeometry
from station.diagnosis.observations.views import fixed_view
from tests.unit.diagnosis.recorded import golden

POINT_M = np.array([[[0.01, 0.02], [0.0, 0.02], [0.0, 0.0], [0.01, 0.0]]])


def turned(geometry: CameraGeometry, angle_rad: float) -> CameraGeometry:
    """The same camera, turned about the plate's normal."""
    cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    homography = turn @ np.reshape(geometry.plate_from_pixel, (3, 3))
    x, y = turn[:2, :2] @ [geometry.camera_x_m, geometry.camera_y_m]
    return replace(
        geometry,
        plate_from_pixel=tuple(homography.ravel()),
        camera_x_m=float(x),
        camera_y_m=float(y),
        mark_height_m=0.0,
    )


@pytest.mark.parametrize("angle_deg", [0.0, 40.0, 90.0, -135.0])
@pytest.mark.parametrize("height_px", [480, 1080])
def test_the_height_of_the_picture_is_so_many_rows_down(angle_deg: float, height_px: int) -> None:
    recorded, _ = golden()
    assert recorded.geometry is not None
    geometry = turned(recorded.geometry, math.radians(angle_deg))
    view = fixed_view(POINT_M, geometry, image_height_px=height_px, tilt_rad=np.zeros(1), down_rad=np.zeros(1))
    ends = view.image_centre_m + np.outer([-0.1, 0.1], view.image_size_m * view.row_m)
    first, second = pixels_of_mark(ends, geometry)
    assert second - first == pytest.approx([0.0, 0.2 * height_px], abs=1e-3 * height_px)
