"""The three-dimensional scene: arm, plate with its foam border, and the block with the trail of its slide."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping

import numpy as np
import rerun as rr

from shared import frames
from shared.foxglove import FrameTransform, FrameTransforms
from shared.geometry import block_pose_of, downhill_of, tilt_of
from shared.messages import BlockPose, CameraGeometry, JointState, MarkerCorners, PlatformState, RunEvent
from station.rig.arm_model import ArmModel, link_transforms
from station.view import colours, entities, shapes
from station.view.canvas import Canvas, Cap
from station.view.part import Handler, Rates
from station.view.setup import Setup

_TRAIL_LIFT_M = 5e-4
_TRAIL_STEP = 0.05
"""The trail's next point is at least this share of the block's side away."""


class ArmPart:
    """The arm as capsules, and its joint angles as curves."""

    def __init__(self, canvas: Canvas, setup: Setup, rates: Rates) -> None:
        self._canvas, self._model, self._drawings = canvas, setup.arm, Cap(rates.drawing_hz)
        self._world_from_base = np.eye(4) if setup.world_from_base is None else setup.world_from_base
        self._named = False
        if self._model is not None:
            self._shape = shapes.ArmShape(self._model)

    def handlers(self) -> Mapping[str, Handler]:
        """Returns the handler of the arm's joint states."""
        return {"arm/joints": self._on_joints}

    def _on_joints(self, joints: JointState) -> None:
        self._canvas.curve(entities.JOINTS, *(math.degrees(angle) for angle in joints.position_rad))
        if not self._named:
            self._named = True
            colors = [colours.CORNERS[i % len(colours.CORNERS)] for i in range(len(joints.position_rad))]
            self._canvas.name_curves(entities.JOINTS, joints.name, colors)
            if self._model is not None:
                self._canvas.log(entities.ARM, self._shape.shape())
        if self._model is not None and self._drawings.due(self._canvas.now_ns):
            self._draw(self._model, joints)

    def _draw(self, model: ArmModel, joints: JointState) -> None:
        by_name = dict(zip(joints.name, joints.position_rad, strict=False))
        if not set(model.joint_names) <= set(by_name):
            return  # another arm than the rig file's
        links = link_transforms(model, [by_name[name] for name in model.joint_names])
        world_from_link = self._world_from_base @ np.concatenate([np.eye(4)[None], links])
        self._canvas.log(entities.ARM, self._shape.pose(world_from_link))


class PlatePart:
    """The plate and its foam border, tilted as the arm says; without an arm it lies level in the origin."""

    def __init__(self, canvas: Canvas, setup: Setup, rates: Rates) -> None:
        self._canvas, self._setup, self._drawings = canvas, setup, Cap(rates.drawing_hz)
        self._by_arm = False
        canvas.static(entities.WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP)
        canvas.static(entities.PLATE, shapes.plate(setup))
        arrow = rr.Arrows3D.from_fields(
            origins=[[0.0, 0.0, setup.foam_height_m]], colors=[colours.TILT], radii=[0.01 * setup.plate_side_m]
        )
        canvas.look(entities.DOWNHILL, arrow)
        if setup.opening_m is not None:
            canvas.static(entities.FOAM, shapes.foam(setup, opening_m=setup.opening_m))

    def handlers(self) -> Mapping[str, Handler]:
        """Returns the handlers of the plate's attitude and of the transforms."""
        return {"arm/platform": self._on_platform, "tf": self._on_tf}

    def _on_platform(self, state: PlatformState) -> None:
        self._by_arm = True
        if not self._drawings.due(self._canvas.now_ns):
            return
        move = frames.platform_transform(state, pivot_above_plate_m=self._setup.pivot_above_plate_m)
        self._canvas.log(entities.PLATFORM, transform_of(move))
        self._draw_downhill(state)

    def _draw_downhill(self, state: PlatformState) -> None:
        """Draws an arrow down the slope, beside the plate's middle, as long as the tilt is steep."""
        x, y = downhill_of(state.qw, state.qx, state.qy, state.qz)
        steep = math.sin(tilt_of(state.qw, state.qx, state.qy, state.qz)) * self._setup.plate_side_m
        self._canvas.log(entities.DOWNHILL, rr.Arrows3D.from_fields(vectors=[[x * steep, y * steep, 0.0]]))

    def _on_tf(self, message: FrameTransforms) -> None:
        for move in message.transforms:
            if move.child_frame_id == frames.PLATFORM and not self._by_arm and self._drawings.due(self._canvas.now_ns):
                self._canvas.log(entities.PLATFORM, transform_of(move))


class BlockPart:
    """The block on the plate, from its mark's corners or from another tracker, with curves of its slide."""

    def __init__(self, canvas: Canvas, setup: Setup, rates: Rates) -> None:
        self._canvas, self._setup, self._drawings = canvas, setup, Cap(rates.drawing_hz)
        self._geometry: CameraGeometry | None = None
        self._seen = False
        self._start: tuple[float, float] | None = None
        self._shaped = False
        self._trail: deque[tuple[float, float, float]] = deque(maxlen=400)
        canvas.look(entities.TRAIL, rr.LineStrips3D.from_fields(colors=[colours.BLOCK], radii=[colours.LINE]))
        for path, name, colour in (
            (entities.SLID, "slid (mm)", colours.BLOCK),
            (entities.HEIGHT, "height of the middle (mm)", colours.TILT),
        ):
            canvas.name_curves(path, [name], [colour])

    def handlers(self) -> Mapping[str, Handler]:
        """Returns the handlers of all that places the block: corners, geometry, poses, phases and transforms."""
        return {
            "camera/geometry": self._on_geometry,
            "camera/corners": self._on_corners,
            "block/pose": self._on_pose,
            "session/event": self._on_event,
            "tf": self._on_tf,
        }

    def _on_geometry(self, geometry: CameraGeometry) -> None:
        self._geometry = geometry.if_calibrated()

    def _on_event(self, event: RunEvent) -> None:
        if event.phase in ("LEVEL", "REFERENCE"):
            self._trail.clear()
            if self._start is not None:
                self._start = None
                self._canvas.gap(entities.SLID)

    def _on_corners(self, corners: MarkerCorners) -> None:
        if self._geometry is None or not corners.found:
            return
        x, y, yaw = block_pose_of(corners.corners_px, self._geometry)
        height = self._setup.block_size_m[2]
        move = frames.block_transform(x_m=x, y_m=y, yaw_rad=yaw, height_m=height, stamp_ns=corners.capture_ns)
        self._take(move)

    def _on_pose(self, pose: BlockPose) -> None:
        if pose.found:
            self._take(frames.block_pose_transform(pose))

    def _on_tf(self, message: FrameTransforms) -> None:
        for move in message.transforms:
            if move.child_frame_id == frames.BLOCK and not self._seen:
                self._draw(move)

    def _take(self, move: FrameTransform) -> None:
        self._seen = True
        place = move.translation
        self._start = self._start or (place.x, place.y)
        slid_m = math.hypot(place.x - self._start[0], place.y - self._start[1])
        self._canvas.curve(entities.SLID, 1e3 * slid_m)
        self._canvas.curve(entities.HEIGHT, 1e3 * place.z)
        self._draw(move)

    def _draw(self, move: FrameTransform) -> None:
        if not self._shaped:
            self._shaped = True
            self._canvas.static(entities.BLOCK, shapes.block(self._setup))
            self._canvas.static(entities.MARK, shapes.mark(self._setup))
        if not self._drawings.due(self._canvas.now_ns):
            return
        self._canvas.log(entities.BLOCK, transform_of(move))
        self._draw_trail(move)

    def _draw_trail(self, move: FrameTransform) -> None:
        """Draws a line along the plate where the block has been in this run; it grows only while the block moves."""
        place = move.translation
        at = (place.x, place.y, max(place.z - 0.5 * self._setup.block_size_m[2], 0.0) + _TRAIL_LIFT_M)
        if self._trail and math.dist(at, self._trail[-1]) < _TRAIL_STEP * self._setup.block_size_m[0]:
            return
        self._trail.append(at)
        strips = [list(self._trail)]
        self._canvas.log(entities.TRAIL, rr.LineStrips3D.from_fields(strips=strips))


def transform_of(move: FrameTransform) -> rr.Transform3D:
    """Returns a frame's transform as Rerun takes it."""
    at, q = move.translation, move.rotation
    return rr.Transform3D(translation=[at.x, at.y, at.z], quaternion=rr.Quaternion(xyzw=[q.x, q.y, q.z, q.w]))
