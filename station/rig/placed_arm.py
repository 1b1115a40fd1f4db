"""The arm of a rig where it stands: its model, its foot in the world, and each link in the frame before it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from shared.frames import WORLD
from shared.geometry import Quaternion, quaternion_from_matrix
from shared.rig import RigConfig
from station.rig.arm_model import ArmModel, Array, Vector, load_arm_model, transform
from station.rig.arm_settings import arm_settings

BASE = "base"
"""The frame of the arm's foot; each link's frame has the name of the joint that moves it."""


@dataclass(frozen=True, kw_only=True)
class Step:
    """A frame in the frame before it: parent_from_child, in metres and as a unit quaternion."""

    parent: str
    child: str
    xyz_m: Vector
    quaternion_wxyz: Quaternion


@dataclass(frozen=True, kw_only=True)
class PlacedArm:
    """An arm and the pose of its foot, world_from_base (4, 4)."""

    model: ArmModel
    world_from_base: Array

    @cached_property
    def foot(self) -> Step:
        """The arm's foot in the world."""
        x, y, z = self.world_from_base[:3, 3].tolist()
        rotation = quaternion_from_matrix(self.world_from_base[:3, :3])
        return Step(parent=WORLD, child=BASE, xyz_m=(x, y, z), quaternion_wxyz=rotation)

    def links(self, position_rad: Sequence[float]) -> Iterator[Step]:
        """Yields every link in the link before it, base first, for the joint angles (n,) in the model's order."""
        parent = BASE
        for joint, origin, angle in zip(self.model.joints, self._origins, position_rad, strict=True):
            turned = _turned(origin, joint.axis, angle)
            yield Step(parent=parent, child=joint.name, xyz_m=joint.origin_xyz_m, quaternion_wxyz=turned)
            parent = joint.name

    @cached_property
    def _origins(self) -> tuple[Quaternion, ...]:
        """Each joint's frame at the angle 0, in the frame before it."""
        turns = (transform(joint.origin_xyz_m, joint.origin_rpy_rad)[:3, :3] for joint in self.model.joints)
        return tuple(quaternion_from_matrix(turn) for turn in turns)


def placed_arm(rig: RigConfig) -> PlacedArm:
    """Returns the arm that a rig file describes.

    Raises:
        UserError: if its `[arm]` table is wrong or names an unknown model.
    """
    settings = arm_settings(rig)
    model = load_arm_model(settings.model)
    yaw_rad = settings.base_yaw_rad(model.home_yaw_rad)
    return PlacedArm(model=model, world_from_base=transform(settings.base_xyz_m, (0.0, 0.0, yaw_rad)))


def _turned(origin: Quaternion, axis: Vector, angle_rad: float) -> Quaternion:
    """Returns the quaternion product of a joint's origin and its turn about a unit axis."""
    w, x, y, z = origin
    sine, c = math.sin(0.5 * angle_rad), math.cos(0.5 * angle_rad)
    a, b, d = (sine * part for part in axis)
    return (
        w * c - x * a - y * b - z * d,
        w * a + x * c + y * d - z * b,
        w * b - x * d + y * c + z * a,
        w * d + x * b - y * a + z * c,
    )
