"""A short made-up session with everything that a view shows: one run that tilts, slides, settles and returns."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from PIL import Image, ImageDraw

from shared import foxglove, frames
from shared import messages as m
from shared.geometry import block_pose_of, mark_corners, pixels_of_mark, plate_from_pixel, quaternion_from_matrix
from station.rig.arm_model import ArmModel, forward_kinematics, load_arm_model

START_NS = 1_600_000_000_000_000_000
SIZE_PX = 600
SIDE_M = 0.01
SLIP_S = 3.0
END_S = 5.0
Item = tuple[str, m.Message, int]

GEOMETRY = m.CameraGeometry(
    stamp_ns=START_NS,
    plate_from_pixel=tuple(plate_from_pixel(px_per_m=6000.0, centre_px=(299.5, 299.5)).ravel().tolist()),
    mm_per_px=1 / 6,
    marker_side_m=SIDE_M,
    mark_height_m=SIDE_M,
    camera_height_m=0.3,
    corner_sigma_px=0.05,
    source="made up",
)
PHASES = (
    (0.0, "LEVEL"),
    (0.4, "DWELL"),
    (0.8, "REFERENCE"),
    (1.2, "TILT"),
    (SLIP_S, "SLIP"),
    (3.4, "SETTLE"),
    (3.8, "RETURN"),
    (4.8, "DONE"),
)


def session_messages(*, camera: bool = True, arm: bool = True) -> Iterator[Item]:
    """Topic, message and publish time, in the order of time."""
    model = load_arm_model("jaco2_spherical") if arm else None
    items: list[Item] = []
    for seconds, phase in PHASES:
        stamp = _ns(seconds)
        items.append(("session/event", m.RunEvent(stamp_ns=stamp, run=1, phase=phase), stamp))
        items.append(("log", _log(stamp, f"run 1: {phase}"), stamp))
    for step in range(1, 9):
        begin, end = 1.2 + 0.225 * (step - 1), 1.2 + 0.225 * step - 0.1
        command = m.TiltCommand(stamp_ns=_ns(begin), run=1, angle_rad=math.radians(3 * step), step=step)
        items.append(("arm/command", command, _ns(begin)))
        motion = m.MotionReport(stamp_ns=_ns(begin), run=1, step=step, begin_ns=_ns(begin))
        items.append(("arm/motion", motion, _ns(begin)))
        items.append(("arm/motion", replace(motion, stamp_ns=_ns(end), end_ns=_ns(end)), _ns(end)))
    for index in range(int(END_S * 10)):
        stamp = _ns(index / 10)
        items.append(("session/heartbeat", m.Heartbeat(stamp_ns=stamp, armed=index > 3), stamp))
    items.append(("session/sample", sample(), _ns(3.3)))
    items.append(("log", _log(_ns(3.0), "3 of 4 corners moved further than the threshold", "warning"), _ns(3.0)))
    for index in range(int(END_S * 90)):
        items += _frame(index, camera=camera)
    if model:
        for index in range(int(END_S * 50)):
            items += _arm(model, index / 50)
    return iter(sorted(items, key=lambda item: item[2]))


def sample() -> m.Sample:
    corners = tuple(corners_at(0.0).ravel().tolist())
    return m.Sample(
        run=1,
        start_ns=START_NS,
        slip_ns=_ns(SLIP_S),
        detect_ns=_ns(3.3),
        reference_corners_px=corners,
        onset_angle_rad=tilt_at(SLIP_S),
        onset_sigma_rad=0.002,
    )


def tilt_at(seconds: float) -> float:
    """The tilt in radians: up to 24 degrees at the slip, then held, then back."""
    up, down = (seconds - 1.2) / (SLIP_S - 1.2), (4.8 - seconds) / 1.0
    return math.radians(24.0) * max(0.0, min(1.0, up, down))


def slide_at(seconds: float) -> float:
    """Returns how far the block has slid, in metres."""
    return min(0.022, max(0.0, 0.5 * 0.6 * (seconds - SLIP_S) ** 2 if seconds > SLIP_S else 0.0))


def corners_at(seconds: float) -> np.ndarray:
    """The mark's corners (4, 2) in pixels."""
    turn = 0.15 + 4.0 * slide_at(seconds)
    c, s = math.cos(turn), math.sin(turn)
    points = mark_corners(side_m=SIDE_M) @ np.array([[c, s], [-s, c]]) + [-0.01, slide_at(seconds)]
    return pixels_of_mark(points, GEOMETRY)


def picture(corners_px: np.ndarray, *, encoding: str = "jpeg") -> bytes:
    """A frame with the dark mark on a light plate, encoded."""
    image = Image.new("L", (SIZE_PX, SIZE_PX), 170)
    draw = ImageDraw.Draw(image)
    for y in range(0, SIZE_PX, 50):
        draw.line([(0, y), (SIZE_PX, y)], fill=160)
    draw.polygon([tuple(corner) for corner in corners_px.tolist()], fill=30)
    buffer = io.BytesIO()
    image.save(buffer, format=encoding)
    return buffer.getvalue()


def _ns(seconds: float) -> int:
    return START_NS + round(seconds * 1e9)


def _log(stamp: int, text: str, level: str = "info") -> foxglove.Log:
    return foxglove.Log(
        timestamp=foxglove.Timestamp.from_ns(stamp), level=foxglove.LEVELS[level], message=text, name="station"
    )


def _frame(index: int, *, camera: bool) -> list[Item]:
    seconds = index / 90
    stamp, corners = _ns(seconds), corners_at(seconds)
    x, y, yaw = block_pose_of(corners.ravel().tolist(), GEOMETRY)
    if not camera:
        pose = m.BlockPose(
            stamp_ns=stamp, seq=index, x=x, y=y, z=SIDE_M / 2, qw=math.cos(yaw / 2), qz=math.sin(yaw / 2), found=True
        )
        return [("block/pose", pose, stamp)]
    items: list[Item] = [
        (
            "camera/corners",
            m.MarkerCorners(
                capture_ns=stamp, seq=index, corners_px=tuple(corners.ravel().tolist()), sigma_px=0.05, found=True
            ),
            stamp,
        )
    ]
    k = frames.pinhole_of(GEOMETRY)
    if index % 9 == 0:
        items.append(("camera/image", frames.image(picture(corners), stamp_ns=stamp), stamp))
        cloud = frames.overlay(corners, K=k, depth_m=0.3 - SIDE_M, stamp_ns=stamp)
        items.append(("camera/image/overlay", cloud, stamp))
    if index % 90 == 0:
        items.append(
            ("camera/calibration", frames.calibration(width_px=SIZE_PX, height_px=SIZE_PX, K=k, stamp_ns=stamp), stamp)
        )
        items.append(("camera/geometry", GEOMETRY, stamp))
        items.append(("camera/status", m.AgentStatus(stamp_ns=stamp, frames=index, rate_hz=90.0), stamp))
    return items


def _arm(model: ArmModel, seconds: float) -> list[Item]:
    stamp = _ns(seconds)
    q = np.array(model.home_rad)
    q[4] += tilt_at(seconds)
    pivot = forward_kinematics(model, q) @ model.flange_from_pivot
    qw, qx, qy, qz = quaternion_from_matrix(pivot[:3, :3])
    px, py, pz = pivot[:3, 3].tolist()
    state = m.PlatformState(stamp_ns=stamp, qw=qw, qx=qx, qy=qy, qz=qz, px=px, py=py, pz=pz, frame_id=frames.WORLD)
    joints = m.JointState(stamp_ns=stamp, name=model.joint_names, position_rad=tuple(q.tolist()))
    x, y, yaw = block_pose_of(corners_at(seconds).ravel().tolist(), GEOMETRY)
    tf = frames.tf(
        frames.platform_transform(state, pivot_above_plate_m=model.pivot_above_plate_m),
        frames.camera_transform(GEOMETRY, stamp_ns=stamp),
        frames.block_transform(x_m=x, y_m=y, yaw_rad=yaw, height_m=SIDE_M, stamp_ns=stamp),
    )
    return [("arm/joints", joints, stamp), ("arm/platform", state, stamp), ("tf", tf, stamp)]
