"""Rotations, the plate frame and the camera's view of it.

Quaternions are (w, x, y, z), unit, and rotate from the frame after `_from_` to the one before it. The plate frame is
right-handed: origin at the plate's centre on its surface, x along the image's +x, z out of the plate (up when level,
towards the camera), and so y along the image's −y, because rows of an image run downwards. That one change of sign
stands in the homography `plate_from_pixel` and nowhere else.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shared.foxglove import CameraCalibration
from shared.messages import CameraGeometry

Array = NDArray[np.float64]
Quaternion = tuple[float, float, float, float]
_UNDISTORT_ROUNDS = 12


def quaternion_from_matrix(rotation: Array) -> Quaternion:
    """Returns the unit quaternion (w ≥ 0) of a rotation matrix (3, 3), by Shepperd's method: stable at every angle."""
    m = rotation
    choices = np.array([m[0, 0] + m[1, 1] + m[2, 2], m[0, 0], m[1, 1], m[2, 2]])
    largest = int(np.argmax(choices))
    if largest == 0:
        q = np.array([1 + choices[0], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q = np.empty(4)
        q[0] = m[k, j] - m[j, k]
        q[1 + i] = 1 + m[i, i] - m[j, j] - m[k, k]
        q[1 + j] = m[j, i] + m[i, j]
        q[1 + k] = m[k, i] + m[i, k]
    q *= math.copysign(1.0, q[0]) / np.linalg.norm(q)
    return cast(Quaternion, tuple(q.tolist()))


def matrix_from_quaternion(q: ArrayLike) -> Array:
    """Returns the rotation matrix (3, 3) of a quaternion, which need not be normalised."""
    w, x, y, z = np.asarray(q, dtype=float) / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def tilt_of(qw: float, qx: float, qy: float, qz: float) -> float:
    """Returns the angle in radians between the plate's normal and the world's up, from world_from_plate."""
    # z of the normal is 1 − 2 (x² + y²); the half-angle form keeps its accuracy near level, where arccos loses it.
    # The square of a number below 1e-162 is zero; nothing else lets the root be.
    norm = math.sqrt(qw * qw + qx * qx + qy * qy + qz * qz) or math.hypot(qw, qx, qy, qz)
    return 2.0 * math.asin(min(1.0, math.hypot(qx, qy) / norm))


def downhill_of(qw: float, qx: float, qy: float, qz: float) -> tuple[float, float]:
    """Returns the unit vector in the plate (plate frame) that points down the steepest line; (0, 0) when level."""
    down_x, down_y = -2.0 * (qx * qz - qw * qy), -2.0 * (qy * qz + qw * qx)
    length = math.hypot(down_x, down_y)
    return (down_x / length, down_y / length) if length > 1e-9 else (0.0, 0.0)


def euler_of(qw: float, qx: float, qy: float, qz: float) -> tuple[float, float, float]:
    """Returns roll, pitch and yaw (rad) with world_from_plate = Rz(yaw) Ry(pitch) Rx(roll), as ROS and the paper do."""
    roll = math.atan2(2 * (qw * qx + qy * qz), 1 - 2 * (qx * qx + qy * qy))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (qw * qy - qz * qx))))
    yaw = math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
    return roll, pitch, yaw


def plate_from_pixel(*, px_per_m: float, centre_px: tuple[float, float]) -> Array:
    """Returns the homography (3, 3) of a camera that looks straight down: metres in the plate frame from pixels."""
    scale = 1.0 / px_per_m
    return np.array([[scale, 0.0, -scale * centre_px[0]], [0.0, -scale, scale * centre_px[1]], [0.0, 0.0, 1.0]])


def undistort(points_px: ArrayLike, *, intrinsics: ArrayLike, distortion: Sequence[float]) -> Array:
    """Returns the pixels (n, 2) at which the same camera without its lens's distortion would see points (n, 2).

    OpenCV's model with k1, k2, p1, p2, k3 (as many as are given) is inverted by fixed-point iteration, which converges
    for the mild distortion of such lenses to below 0.001 px.

    Args:
        points_px: seen points (n, 2).
        intrinsics: K (3, 3) or its nine numbers row by row.
        distortion: the coefficients; none, or all zero, leaves the points as they are.
    """
    seen = np.reshape(np.asarray(points_px, dtype=float), (-1, 2))
    if not any(distortion):
        return seen
    k1, k2, p1, p2, k3 = (*distortion, 0.0, 0.0, 0.0, 0.0, 0.0)[:5]
    camera = np.reshape(np.asarray(intrinsics, dtype=float), (3, 3))
    focal, centre = np.array([camera[0, 0], camera[1, 1]]), camera[:2, 2]
    target = (seen - centre) / focal
    point = target.copy()
    for _ in range(_UNDISTORT_ROUNDS):
        x, y = point[:, 0], point[:, 1]
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        tangential = np.column_stack([2 * p1 * x * y + p2 * (r2 + 2 * x * x), p1 * (r2 + 2 * y * y) + 2 * p2 * x * y])
        point = (target - tangential) / radial[:, None]
    return point * focal + centre


def straightened(points_px: ArrayLike, lens: CameraCalibration | None) -> Array:
    """Returns points (n, 2), px, or their numbers in a row, without a lens's distortion, as a homography expects them.

    Without a `lens` they stay as they are.
    """
    points = np.reshape(np.asarray(points_px, dtype=np.float64), (-1, 2))
    return points if lens is None else undistort(points, intrinsics=lens.K, distortion=lens.D)


def apply_homography(homography: Array, points: ArrayLike) -> Array:
    """Maps `points` (n, 2) by a `homography` (3, 3) of column vectors (x, y, 1); both keep their own units."""
    xy = np.asarray(points, dtype=float)
    mapped = xy @ homography[:, :2].T + homography[:, 2]
    return mapped[:, :2] / mapped[:, 2:]


def mark_scale(geometry: CameraGeometry) -> float:
    """Returns the ratio of the picture's scale, m a pixel, at the mark's height to that on the plate, from above."""
    return 1.0 - geometry.mark_height_m / geometry.camera_height_m if geometry.mark_height_m else 1.0


def corners_on_plate(corners_px: ArrayLike, geometry: CameraGeometry) -> Array:
    """Returns plate coordinates (n, 2) in metres of points of the mark, seen at n pixels (n, 2).

    A ray through the pinhole meets the plate's plane further out than the mark's, which is `mark_height_m` above it.
    """
    homography = np.reshape(geometry.plate_from_pixel, (3, 3))
    on_plate = apply_homography(homography, corners_px)
    if geometry.mark_height_m == 0.0:
        return on_plate
    foot = np.array([geometry.camera_x_m, geometry.camera_y_m])
    return foot + (on_plate - foot) * mark_scale(geometry)


def pixels_of_mark(points_m: ArrayLike, geometry: CameraGeometry) -> Array:
    """Returns the pixels (n, 2) at which points of the mark's plane (n, 2, plate frame, metres) are seen."""
    foot = np.array([geometry.camera_x_m, geometry.camera_y_m])
    points = np.asarray(points_m, dtype=float)
    if geometry.mark_height_m:
        points = foot + (points - foot) / mark_scale(geometry)
    return apply_homography(np.linalg.inv(np.reshape(geometry.plate_from_pixel, (3, 3))), points)


def mark_corners(*, side_m: float, aspect: float = 1.0) -> Array:
    """Returns the mark's corners (4, 2) in the block's frame, metres, in their fixed order.

    Clockwise as the camera sees them, from the upper left one when the block's yaw is zero: in the plate frame, whose
    y runs up the image, (−, +), (+, +), (+, −), (−, −).
    """
    half_x, half_y = 0.5 * side_m, 0.5 * side_m * aspect
    return np.array([[-half_x, half_y], [half_x, half_y], [half_x, -half_y], [-half_x, -half_y]])


def block_pose_of(corners_px: Sequence[float], geometry: CameraGeometry) -> tuple[float, float, float]:
    """Returns the block's x, y (m) and yaw (rad) in the plate frame from its mark's corners (x0 y0 … x3 y3).

    The pose is fitted by least squares.

    Plain arithmetic, because it runs many times a second: the rigid fit of four points has a closed form.
    """
    a, b, c, d, e, f, g, h, i = geometry.plate_from_pixel
    raised = mark_scale(geometry)
    u0, v0, u1, v1, u2, v2, u3, v3 = corners_px
    half_x, half_y = 0.5 * geometry.marker_side_m, 0.5 * geometry.marker_side_m * geometry.marker_aspect
    # Turning the model's corners by the yaw that fits best makes the first two sums parallel to (cos yaw, sin yaw).
    cosine = sine = mean_x = mean_y = 0.0
    for u, v, model_x, model_y in (
        (u0, v0, -half_x, half_y),
        (u1, v1, half_x, half_y),
        (u2, v2, half_x, -half_y),
        (u3, v3, -half_x, -half_y),
    ):
        w = g * u + h * v + i or math.nan  # on the plate's horizon, which a tilted camera may see, is no place
        x, y = (a * u + b * v + c) / w, (d * u + e * v + f) / w
        cosine += model_x * x + model_y * y
        sine += model_x * y - model_y * x
        mean_x += 0.25 * x
        mean_y += 0.25 * y
    foot_x, foot_y = geometry.camera_x_m, geometry.camera_y_m
    return foot_x + (mean_x - foot_x) * raised, foot_y + (mean_y - foot_y) * raised, math.atan2(sine, cosine)
