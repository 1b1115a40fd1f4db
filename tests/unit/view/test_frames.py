"""The frame messages put what was seen back where it was."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from shared import foxglove, frames
from shared.geometry import (
    apply_homography,
    block_pose_of,
    mark_corners,
    matrix_from_quaternion,
    pixels_of_mark,
    plate_from_pixel,
)
from shared.messages import BlockPose, CameraGeometry, MarkerCorners, PlatformState

HEIGHT_M = 0.3


def straight_down() -> CameraGeometry:
    homography = plate_from_pixel(px_per_m=6000.0, centre_px=(299.5, 299.5))
    return CameraGeometry(
        stamp_ns=7, plate_from_pixel=tuple(homography.ravel().tolist()), camera_height_m=HEIGHT_M, mark_height_m=0.01
    )


def rotation_of(transform: foxglove.FrameTransform) -> np.ndarray:
    q = transform.rotation
    return matrix_from_quaternion((q.w, q.x, q.y, q.z))


def place_of(transform: foxglove.FrameTransform) -> np.ndarray:
    return np.array([transform.translation.x, transform.translation.y, transform.translation.z])


def test_camera_above_the_plate_looks_down_with_x_along_the_plates_x() -> None:
    transform = frames.camera_transform(straight_down())
    np.testing.assert_allclose(place_of(transform), [0, 0, HEIGHT_M], atol=1e-9)
    np.testing.assert_allclose(rotation_of(transform), np.diag([1, -1, -1]), atol=1e-9)
    assert (transform.parent_frame_id, transform.child_frame_id) == ("platform", "camera")


def test_camera_pose_is_recovered_from_a_homography_of_a_leaning_camera() -> None:
    k = np.array([[1800.0, 0, 310], [0, 1800, 290], [0, 0, 1]])
    lean = matrix_from_quaternion((1.0, 0.05, -0.08, 0.1)) @ np.diag([1.0, -1.0, -1.0])
    place = np.array([0.02, -0.01, 0.31])
    pixel_from_plate = k @ np.column_stack([lean.T[:, 0], lean.T[:, 1], -lean.T @ place])
    geometry = CameraGeometry(plate_from_pixel=tuple(np.linalg.inv(pixel_from_plate * -3.0).ravel().tolist()))
    rotation, found = frames.camera_pose(geometry, K=k)
    np.testing.assert_allclose(rotation, lean, atol=1e-9)
    np.testing.assert_allclose(found, place, atol=1e-9)


def test_overlay_lies_on_the_mark_in_the_scene_and_half_a_pixel_over_in_the_image() -> None:
    geometry = straight_down()
    corners_m = mark_corners(side_m=0.01) + np.array([0.02, 0.01])
    pixels = pixels_of_mark(corners_m, geometry)
    k = frames.pinhole_of(geometry)
    cloud = frames.overlay(pixels, K=k, depth_m=HEIGHT_M - 0.01, stamp_ns=3)
    points = np.frombuffer(cloud.data, dtype="<f4").reshape(-1, 4)[:4, :3].astype(float)
    np.testing.assert_allclose(apply_homography(k, points[:, :2] / points[:, 2:]), pixels + 0.5, atol=1e-3)
    transform = frames.camera_transform(geometry)
    on_plate = points @ rotation_of(transform).T + place_of(transform)
    half_pixel_m = 0.5 / 6000 * (HEIGHT_M - 0.01) / HEIGHT_M
    np.testing.assert_allclose(on_plate[:, :2], corners_m + np.array([half_pixel_m, -half_pixel_m]), atol=1e-6)
    np.testing.assert_allclose(on_plate[:, 2], 0.01, atol=1e-6)
    assert cloud.frame_id == frames.CAMERA
    assert len(cloud.data) % cloud.point_stride == 0


def test_no_corners_wipe_the_overlay() -> None:
    assert frames.overlay((), K=np.eye(3), depth_m=0.3, stamp_ns=1).data == b""


def test_plate_origin_lies_under_the_pivot_along_the_tilted_normal() -> None:
    half = math.radians(15)
    state = PlatformState(stamp_ns=5, qw=math.cos(half), qx=math.sin(half), px=0.2, py=0.1, pz=0.5)
    origin = place_of(frames.platform_transform(state, pivot_above_plate_m=0.01))
    assert origin == pytest.approx((0.2, 0.1 + 0.01 * math.sin(2 * half), 0.5 - 0.01 * math.cos(2 * half)))


def test_block_stands_on_the_plate() -> None:
    transform = frames.block_transform(x_m=0.01, y_m=0.02, yaw_rad=0.5, height_m=0.03, stamp_ns=4)
    assert place_of(transform) == pytest.approx((0.01, 0.02, 0.015))
    assert rotation_of(transform)[0, 0] == pytest.approx(math.cos(0.5))
    assert transform.timestamp.ns == 4


def test_a_geometry_at_its_defaults_places_neither_camera_nor_block() -> None:
    corners, bare = MarkerCorners(corners_px=(1.0,) * 8, found=True), CameraGeometry()
    placed = {"now_ns": 5, "attitude": None, "corners": corners, "pivot_above_plate_m": 0.01, "block_height_m": 0.03}
    assert frames.seen(**placed, geometry=bare).transforms == ()  # pyright: ignore[reportArgumentType]
    low = replace(straight_down(), camera_height_m=0.0, mark_height_m=0.0)
    children = [each.child_frame_id for each in frames.seen(**placed, geometry=low).transforms]  # pyright: ignore[reportArgumentType]
    assert children == [frames.BLOCK]


def test_a_corner_on_the_plates_horizon_has_no_place() -> None:
    geometry = replace(straight_down(), plate_from_pixel=(1e-4, 0.0, 0.0, 0.0, 1e-4, 0.0, 0.01, 0.0, -1.0))
    assert all(map(math.isnan, block_pose_of((100.0, 5.0) * 4, geometry)))


def test_another_trackers_pose_is_taken_as_it_is() -> None:
    pose = BlockPose(stamp_ns=9, x=1.0, y=2.0, z=3.0, qw=0.5, qx=0.5, qy=0.5, qz=0.5)
    transform = frames.block_pose_transform(pose)
    assert place_of(transform) == pytest.approx((1.0, 2.0, 3.0))
    assert transform.rotation == foxglove.Quaternion(x=0.5, y=0.5, z=0.5, w=0.5)


def test_calibration_names_the_cameras_frame_and_has_every_matrix() -> None:
    message = frames.calibration(width_px=600, height_px=500, K=np.diag([1800.0, 1800.0, 1.0]), stamp_ns=2)
    assert message.frame_id == frames.CAMERA
    assert (len(message.D), len(message.K), len(message.R), len(message.P)) == (5, 9, 9, 12)
