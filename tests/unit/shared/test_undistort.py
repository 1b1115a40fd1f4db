"""The lens's distortion undone, against OpenCV's own."""

import cv2
import numpy as np

from shared.geometry import undistort

INTRINSICS = np.array([[1500.0, 0.0, 301.0], [0.0, 1490.0, 296.0], [0.0, 0.0, 1.0]])
LENS = (-0.35, 0.12, 0.0008, -0.0005, 0.03)


def test_undoes_what_opencv_does():
    grid = np.stack(np.meshgrid(np.linspace(0, 599, 9), np.linspace(0, 599, 9)), axis=-1).reshape(-1, 2)
    rays = np.column_stack([(grid - INTRINSICS[:2, 2]) / INTRINSICS[[0, 1], [0, 1]], np.ones(len(grid))])
    seen, _ = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), INTRINSICS, np.array(LENS))
    assert np.abs(seen.reshape(-1, 2) - grid).max() > 1.0
    found = undistort(seen.reshape(-1, 2), intrinsics=INTRINSICS, distortion=LENS)
    np.testing.assert_allclose(found, grid, atol=1e-3)


def test_without_distortion_nothing_moves():
    points = np.array([[1.0, 2.0], [300.0, 400.0]])
    np.testing.assert_array_equal(undistort(points, intrinsics=INTRINSICS, distortion=()), points)
    np.testing.assert_array_equal(undistort(points, intrinsics=INTRINSICS, distortion=(0.0,) * 5), points)
