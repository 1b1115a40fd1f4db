"""Finds what the arm touches: itself, the table or the camera's mount, by MuJoCo on its links' capsules and hulls.

The same model gives the torques that hold the arm against gravity. Parts that meet at a joint may touch.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from station.arm.bindings import mj, place
from station.rig.arm_model import ArmModel, Capsule, Joint, transform
from station.rig.arm_settings import ObstacleSettings

Array = NDArray[np.float64]
_FAR_M = 0.5
_NEIGHBOURS = 2  # links this close in the chain share a joint's housing and always touch
_PLATE_M = 0.006
_POST_M = 0.004


@dataclass(frozen=True, slots=True)
class Clearance:
    """The smallest distance between two parts that must not touch (negative: they overlap), and their names."""

    distance_m: float
    parts: str


class CollisionScene:
    """The arm in its surroundings, posed by joint angles."""

    def __init__(self, model: ArmModel, *, world_from_base: Array, obstacles: ObstacleSettings) -> None:
        self._arm = model
        self._clearance_m = obstacles.clearance_m
        spec = mj.MjSpec()
        spec.option.disableflags = mj.mjtDisableBit.mjDSBL_CONTACT | mj.mjtDisableBit.mjDSBL_CONSTRAINT
        self._ranks: dict[str, int] = {}
        self._build(spec, world_from_base, obstacles)
        self._model: Any = spec.compile()
        self._data: Any = mj.MjData(self._model)
        self._pairs = self._find_pairs()

    def _build(self, spec: Any, world_from_base: Array, obstacles: ObstacleSettings) -> None:
        self._add(spec.worldbody, "the table", -9, type=mj.mjtGeom.mjGEOM_PLANE, pos=[0, 0, obstacles.table_m])
        for number, (x, y, z, *sizes) in enumerate(obstacles.walls_m):
            self._box(spec.worldbody, f"wall {number + 1}", -9, pos=(x, y, z), sizes=tuple(sizes))
        body = spec.worldbody.add_body(name="base", **place(world_from_base))
        self._capsule(body, "the base", -1, self._arm.base_capsule, mass=self._arm.base_mass_kg)
        for rank, joint in enumerate(self._arm.joints):
            body = body.add_body(name=joint.name, **place(transform(joint.origin_xyz_m, joint.origin_rpy_rad)))
            body.add_joint(name=joint.name, type=mj.mjtJoint.mjJNT_HINGE, axis=joint.axis)
            self._link(spec, body, rank, joint)
        self._mount(body, len(self._arm.joints), obstacles)

    def _link(self, spec: Any, body: Any, rank: int, joint: Joint) -> None:
        """Adds a link's capsule.

        Where the link has a hull, that is what must not touch, and the capsule has the mass.
        """
        name = f"link {rank + 1}"
        if not joint.link_hull_m:
            self._capsule(body, name, rank, joint.link_capsule, mass=joint.link_mass_kg)
            return
        weight = joint.link_capsule
        body.add_geom(
            type=mj.mjtGeom.mjGEOM_CAPSULE, fromto=[*weight.from_m, *weight.to_m], size=[weight.radius_m, 0, 0],
            mass=joint.link_mass_kg,
        )  # fmt: skip
        spec.add_mesh(name=name).uservert = np.ravel(joint.link_hull_m).tolist()
        self._add(body, name, rank, type=mj.mjtGeom.mjGEOM_MESH, meshname=name)

    def _mount(self, last: Any, rank: int, obstacles: ObstacleSettings) -> None:
        """Adds the plate and, above it, the camera on its posts."""
        plate = last.add_body(name="plate", **place(self._arm.last_from_flange @ self._arm.flange_from_plate))
        side, height = obstacles.plate_side_m, obstacles.camera_height_m
        self._box(plate, "the plate", rank, pos=(0, 0, -_PLATE_M / 2), sizes=(side, side, _PLATE_M))
        if not height:
            return
        self._box(plate, "the camera", rank, pos=(0, 0, height), sizes=obstacles.camera_size_m)
        for number, (x, y) in enumerate([(-1, -1), (-1, 1), (1, -1), (1, 1)]):
            foot = (x * side / 2, y * side / 2, 0.0)
            top = (x * obstacles.camera_size_m[0] / 2, y * obstacles.camera_size_m[1] / 2, height)
            self._capsule(plate, f"camera post {number + 1}", rank, Capsule(from_m=foot, to_m=top, radius_m=_POST_M))

    def _add(self, body: Any, name: str, rank: int, **shape: Any) -> None:
        self._ranks[name] = rank
        body.add_geom(name=name, **({"size": [5, 5, 0.1], "mass": 0.0} | shape))

    def _capsule(self, body: Any, name: str, rank: int, capsule: Capsule, *, mass: float = 0.02) -> None:
        kind = mj.mjtGeom.mjGEOM_CAPSULE
        ends, size = [*capsule.from_m, *capsule.to_m], [capsule.radius_m, 0, 0]
        self._add(body, name, rank, type=kind, fromto=ends, size=size, mass=mass)

    def _box(self, body: Any, name: str, rank: int, *, pos: tuple[float, ...], sizes: tuple[float, ...]) -> None:
        half = [value / 2 for value in sizes]
        self._add(body, name, rank, type=mj.mjtGeom.mjGEOM_BOX, pos=list(pos), size=half, mass=0.05)

    def _find_pairs(self) -> list[tuple[int, int, str]]:
        """Finds all pairs of parts that must not touch.

        It leaves out those close in the chain, and the arm's foot on its table.
        """
        parts = [(int(self._model.geom(name).id), name, rank) for name, rank in self._ranks.items()]
        return [
            (first, second, f"{one} and {other}")
            for i, (first, one, low) in enumerate(parts)
            for second, other, high in parts[i + 1 :]
            if abs(low - high) > _NEIGHBOURS and not (low == -9 and high <= 0)
        ]

    def clearance(self, joints_rad: Array) -> Clearance:
        """Returns the closest two parts at joint angles `joints_rad` (n,), rad."""
        self._data.qpos[:] = joints_rad
        mj.mj_kinematics(self._model, self._data)
        nearest = Clearance(_FAR_M, "nothing")
        for first, second, parts in self._pairs:
            distance = mj.mj_geomDistance(self._model, self._data, first, second, nearest.distance_m, None)
            if distance < nearest.distance_m:
                nearest = Clearance(float(distance), parts)
        return nearest

    def touching(self, joints_rad: Array) -> str:
        """Gives the parts that come too close at joint angles `joints_rad` (n,), rad, in one phrase; empty if clear."""
        nearest = self.clearance(joints_rad)
        if nearest.distance_m >= self._clearance_m:
            return ""
        allowed = self._clearance_m * 1000
        return (
            f"{nearest.parts} come within {nearest.distance_m * 1000:.0f} mm of each other ({allowed:.0f} are wanted)"
        )

    def holding_torque_nm(self, joints_rad: Array) -> Array:
        """Returns the torques (n,), N m, that hold the arm, plate and camera at rest against gravity.

        The joints are at the angles `joints_rad` (n,), rad.
        """
        self._data.qpos[:] = joints_rad
        self._data.qvel[:] = 0
        mj.mj_forward(self._model, self._data)
        return cast(Array, self._data.qfrc_bias.copy())
