"""The mark's own side against the plate's map: each direction counts, and what is not known contradicts nothing."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from shared.geometry import Array, mark_corners, pixels_of_mark, plate_from_pixel
from shared.messages import CameraGeometry
from station.signals.mark_side import contradiction

GEOMETRY = CameraGeometry(
    plate_from_pixel=tuple(plate_from_pixel(px_per_m=6000.0, centre_px=(300.0, 300.0)).ravel().tolist()),
    mm_per_px=1 / 6,
    marker_side_m=0.01,
    marker_aspect=1.5,
    mark_height_m=0.02,
    camera_x_m=0.004,
    camera_height_m=0.3,
)


def seen(stretch: tuple[float, float] = (1.0, 1.0), *, yaw_rad: float = 0.7) -> Array:
    """The pixels (4, 2) of a turned mark on a map that is stretched along the plate's x and y."""
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    turned = mark_corners(side_m=0.01, aspect=1.5) @ np.array([[cosine, sine], [-sine, cosine]])
    return pixels_of_mark((turned + np.array([0.02, -0.01])) * stretch, GEOMETRY)


@pytest.mark.parametrize("yaw_rad", [0.0, 0.7, 3.0, -2.0])
@pytest.mark.parametrize(
    ("stretch", "off"),
    [((1.0, 1.0), 0.0), ((1.05, 1.05), 0.05), ((0.6, 0.6), 0.4), ((1.0, 1.05), 0.05), ((0.95, 1.02), 0.05)],
)
def test_it_is_the_share_by_which_the_map_is_off_in_its_worst_direction(
    stretch: tuple[float, float], off: float, yaw_rad: float
) -> None:
    assert contradiction(seen(stretch, yaw_rad=yaw_rad), GEOMETRY) == pytest.approx(off, abs=1e-9)


def test_a_mirrored_mark_is_another_one() -> None:
    assert contradiction(seen()[::-1], GEOMETRY) > 0.5


@pytest.mark.parametrize("geometry", [replace(GEOMETRY, marker_side_m=0.0), replace(GEOMETRY, marker_aspect=0.0)])
def test_a_mark_of_unknown_size_contradicts_nothing(geometry: CameraGeometry) -> None:
    assert contradiction(seen((1.2, 1.2)), geometry) == 0.0


def test_without_corners_nothing_is_contradicted() -> None:
    assert contradiction((), GEOMETRY) == 0.0


def test_corners_on_the_horizon_are_none() -> None:
    on_it = replace(GEOMETRY, plate_from_pixel=(*GEOMETRY.plate_from_pixel[:6], 1.0, 0.0, 0.0))
    assert math.isnan(contradiction((0.0,) * 8, on_it))
