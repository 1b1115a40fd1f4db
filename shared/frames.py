"""The frames of a rig by name, and the messages by which viewers line image, plate and block up.

    world ── platform ─┬─ camera
                       └─ block

`world` has z up and the arm's base at its origin. `platform` is the plate frame of `shared.geometry`. `camera` is an
optical frame: origin in the pinhole, x right and y down in the image, z forward. `block` has its origin in the middle
of the block's box, its axes parallel to the plate's when the block's yaw is zero.

Viewers put `/camera/image`, `/camera/calibration` and `/camera/image/overlay` over each other because all three carry
the frame id `camera`, and put them into the scene because `/tf` has world > platform > camera. The overlay's topic lies
below the image's, because Rerun shows in an image's view only what lies below it. Pixels outside of this
module follow OpenCV (the centre of the top-left pixel is (0, 0)); viewers put (0, 0) at that pixel's outer corner, so
`overlay` adds the half pixel.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from operator import attrgetter

import numpy as np
from numpy.typing import ArrayLike

from shared import foxglove
from shared.geometry import Array, block_pose_of, quaternion_from_matrix
from shared.messages import BlockPose, CameraGeometry, MarkerCorners, PlatformState

WORLD = "world"
PLATFORM = "platform"
CAMERA = "camera"
BLOCK = "block"

PIXEL_CENTRE = 0.5
"""The offset of a viewer's pixel coordinates from OpenCV's."""

OVERLAY_RGBA = (255, 60, 200, 255)
_DOTS_A_SIDE = 15
_FLOAT32, _UINT8 = 7, 1
_POINT = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgba", "u1", 4)])
_POINT_FIELDS = (
    *(foxglove.PackedElementField(name=name, offset=4 * i, type=_FLOAT32) for i, name in enumerate("xyz")),
    *(
        foxglove.PackedElementField(name=name, offset=12 + i, type=_UINT8)
        for i, name in enumerate(("red", "green", "blue", "alpha"))
    ),
)


def transform(
    *, parent: str, child: str, xyz_m: Sequence[float], quaternion_wxyz: Sequence[float], stamp_ns: int
) -> foxglove.FrameTransform:
    """Returns the pose parent_from_child as a message; translation and rotation are always set."""
    x, y, z = xyz_m
    qw, qx, qy, qz = quaternion_wxyz
    return foxglove.FrameTransform(
        foxglove.Timestamp.from_ns(stamp_ns),
        parent,
        child,
        foxglove.Vector3(x, y, z),
        foxglove.Quaternion(qx, qy, qz, qw),
    )


def plate_origin(state: PlatformState, *, pivot_above_plate_m: float = 0.0) -> tuple[float, float, float]:
    """Returns the plate's centre in the world, metres: the pivot is `pivot_above_plate_m` along the plate's normal."""
    w, x, y, z = state.qw, state.qx, state.qy, state.qz
    normal = (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))
    height = pivot_above_plate_m
    return state.px - height * normal[0], state.py - height * normal[1], state.pz - height * normal[2]


def platform_transform(state: PlatformState, *, pivot_above_plate_m: float = 0.0) -> foxglove.FrameTransform:
    """Returns the transform world > platform from the arm's own account of it."""
    return transform(
        parent=WORLD,
        child=PLATFORM,
        xyz_m=plate_origin(state, pivot_above_plate_m=pivot_above_plate_m),
        quaternion_wxyz=(state.qw, state.qx, state.qy, state.qz),
        stamp_ns=state.stamp_ns,
    )


def pinhole_of(geometry: CameraGeometry) -> Array:
    """Returns K (3, 3) of a camera that looks straight down at the plate, for rigs without measured intrinsics.

    The focal length is the pinhole's height times the pixels per metre, the principal point the pixel at the camera's
    foot.
    """
    pixel_from_plate = np.linalg.inv(np.reshape(geometry.plate_from_pixel, (3, 3)))
    at = pixel_from_plate @ (geometry.camera_x_m, geometry.camera_y_m, 1.0)
    px_per_m = math.sqrt(abs(np.linalg.det(pixel_from_plate[:2, :2]))) / abs(pixel_from_plate[2, 2])
    focal_px = geometry.camera_height_m * px_per_m
    return np.array([[focal_px, 0.0, at[0] / at[2]], [0.0, focal_px, at[1] / at[2]], [0.0, 0.0, 1.0]])


def camera_pose(geometry: CameraGeometry, *, K: ArrayLike) -> tuple[Array, Array]:
    """Returns the pose platform_from_camera: rotation (3, 3) and the pinhole's place (3,) in the plate frame, metres.

    With pixel_from_plate ~ K [r1 r2 t] (Zhang 2000, section 2), r1 and r2 made orthonormal by singular values.
    """
    columns = np.linalg.inv(np.reshape(K, (3, 3))) @ np.linalg.inv(np.reshape(geometry.plate_from_pixel, (3, 3)))
    columns /= math.copysign(np.linalg.norm(columns[:, :2]) / math.sqrt(2.0), columns[2, 2])
    left, _, right = np.linalg.svd(np.column_stack([columns[:, :2], np.cross(columns[:, 0], columns[:, 1])]))
    camera_from_plate = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    return camera_from_plate.T, -camera_from_plate.T @ columns[:, 2]


def camera_transform(
    geometry: CameraGeometry,
    *,
    K: ArrayLike | None = None,
    stamp_ns: int | None = None,
) -> foxglove.FrameTransform:
    """Returns the transform platform > camera.

    Without K (3, 3) the camera is taken to look straight down (`pinhole_of`).
    """
    rotation, place = camera_pose(geometry, K=pinhole_of(geometry) if K is None else K)
    return transform(
        parent=PLATFORM,
        child=CAMERA,
        xyz_m=place.tolist(),
        quaternion_wxyz=quaternion_from_matrix(rotation),
        stamp_ns=geometry.stamp_ns if stamp_ns is None else stamp_ns,
    )


def block_transform(
    *, x_m: float, y_m: float, yaw_rad: float, height_m: float, stamp_ns: int
) -> foxglove.FrameTransform:
    """Returns the transform platform > block for a block of `height_m` that stands on the plate."""
    return transform(
        parent=PLATFORM,
        child=BLOCK,
        xyz_m=(x_m, y_m, 0.5 * height_m),
        quaternion_wxyz=(math.cos(0.5 * yaw_rad), 0.0, 0.0, math.sin(0.5 * yaw_rad)),
        stamp_ns=stamp_ns,
    )


def seen(
    *,
    now_ns: int,
    attitude: PlatformState | None,
    geometry: CameraGeometry | None,
    corners: MarkerCorners | None,
    pivot_above_plate_m: float,
    block_height_m: float,
) -> foxglove.FrameTransforms:
    """Returns the message of topic `tf`, from the last known state of arm, camera and block, as far as it is known."""
    transforms: list[foxglove.FrameTransform] = []
    geometry = geometry and geometry.if_calibrated()
    if attitude is not None:
        transforms.append(platform_transform(attitude, pivot_above_plate_m=pivot_above_plate_m))
    if geometry is not None and geometry.camera_height_m > 0:
        view, now = _view_of(*_PLACED(geometry)), foxglove.Timestamp.from_ns(now_ns)
        transforms.append(foxglove.FrameTransform(now, PLATFORM, CAMERA, view.translation, view.rotation))
    if geometry is not None and corners is not None and corners.found:
        x, y, yaw = block_pose_of(corners.corners_px, geometry)
        stamp_ns = corners.capture_ns
        transforms.append(block_transform(x_m=x, y_m=y, yaw_rad=yaw, height_m=block_height_m, stamp_ns=stamp_ns))
    return tf(*transforms)


_PLACED = attrgetter("plate_from_pixel", "camera_x_m", "camera_y_m", "camera_height_m")
"""The fields of a calibration that determine where the camera is."""


@lru_cache(maxsize=4)
def _view_of(plate_from_pixel: tuple[float, ...], x_m: float, y_m: float, height_m: float) -> foxglove.FrameTransform:
    """Returns the camera's view, computed anew only when the calibration changes, which it rarely does in a session."""
    return camera_transform(
        CameraGeometry(plate_from_pixel=plate_from_pixel, camera_x_m=x_m, camera_y_m=y_m, camera_height_m=height_m)
    )


def block_pose_transform(pose: BlockPose) -> foxglove.FrameTransform:
    """Returns the transform platform > block as another tracker saw it; its z is that of the block's middle."""
    return transform(
        parent=PLATFORM,
        child=BLOCK,
        xyz_m=(pose.x, pose.y, pose.z),
        quaternion_wxyz=(pose.qw, pose.qx, pose.qy, pose.qz),
        stamp_ns=pose.stamp_ns,
    )


def tf(*transforms: foxglove.FrameTransform) -> foxglove.FrameTransforms:
    """Returns the message of topic `tf`."""
    return foxglove.FrameTransforms(transforms=transforms)


def calibration(
    *,
    width_px: int,
    height_px: int,
    K: ArrayLike,
    distortion: Sequence[float] = (),
    stamp_ns: int,
) -> foxglove.CameraCalibration:
    """Gives the message `camera/calibration`; K is (3, 3); `distortion` is OpenCV's k1 k2 p1 p2 k3, empty for none."""
    k = np.reshape(np.asarray(K, dtype=float), (3, 3))
    return foxglove.CameraCalibration(
        timestamp=foxglove.Timestamp.from_ns(stamp_ns),
        frame_id=CAMERA,
        width=width_px,
        height=height_px,
        distortion_model="plumb_bob",
        D=tuple(float(value) for value in distortion) or (0.0,) * 5,
        K=tuple(k.ravel().tolist()),
        R=(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        P=tuple(np.column_stack([k, np.zeros(3)]).ravel().tolist()),
    )


def image(data: bytes, *, stamp_ns: int, encoding: str = "jpeg") -> foxglove.CompressedImage:
    """Returns the message of topic `camera/image`."""
    return foxglove.CompressedImage(
        timestamp=foxglove.Timestamp.from_ns(stamp_ns), frame_id=CAMERA, data=data, format=encoding
    )


def overlay(
    corners_px: ArrayLike,
    *,
    K: ArrayLike,
    depth_m: float,
    stamp_ns: int,
    rgba: tuple[int, int, int, int] = OVERLAY_RGBA,
) -> foxglove.PointCloud:
    """Returns the message of topic `camera/image/overlay`: marks of four pixels each (4n, 2) on the plane at `depth_m`.

    The first 4n points are the corners; dots along the sides follow, because viewers draw points so small that four
    of them would be overlooked. They are put there with K alone, because viewers show the image as it was taken, with
    its distortion. No corners give an empty cloud, which wipes the last one away.
    """
    marks = np.reshape(np.asarray(corners_px, dtype=float), (-1, 4, 2))
    pixels = np.concatenate([marks.reshape(-1, 2), _dots_along(marks)]) + PIXEL_CENTRE
    k = np.reshape(np.asarray(K, dtype=float), (3, 3))
    points = np.zeros(len(pixels), dtype=_POINT)
    points["x"] = (pixels[:, 0] - k[0, 2]) / k[0, 0] * depth_m
    points["y"] = (pixels[:, 1] - k[1, 2]) / k[1, 1] * depth_m
    points["z"] = depth_m
    points["rgba"] = rgba
    return foxglove.PointCloud(
        timestamp=foxglove.Timestamp.from_ns(stamp_ns),
        frame_id=CAMERA,
        point_stride=_POINT.itemsize,
        fields=_POINT_FIELDS,
        data=points.tobytes(),
    )


def _dots_along(marks: Array) -> Array:
    """Returns points (m, 2) along the sides of quadrilaterals (n, 4, 2)."""
    share = np.arange(1, _DOTS_A_SIDE + 1)[:, None, None, None] / (_DOTS_A_SIDE + 1)
    return (marks + share * (np.roll(marks, -1, axis=1) - marks)).reshape(-1, 2)
