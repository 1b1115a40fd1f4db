"""Descriptions of robot arms: joints, limits, the tool with the plate, and where the plate is for given joint angles.

An arm is a TOML file in `station/rig/models/`, so another arm is a new file and no code. Frames: `base` (the arm's
foot, z up), one `link` frame behind each joint, `flange` (end of the arm), `plate` (origin at the centre of the
plate's top, z out of the plate), `pivot` (the plate frame moved to the centre of rotation: the centre of mass of the
block on the plate, paper Fig. 4). A transform `a_from_b` maps coordinates in b to coordinates in a.
"""

from __future__ import annotations

import math
import os
import tomllib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shared.errors import UserError

MODELS = Path(__file__).parent / "models"
Vector = tuple[float, float, float]
Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Capsule:
    """A link's rough shape in its own frame: everything within `radius_m` of a line, for geometry and collisions."""

    from_m: Vector
    to_m: Vector
    radius_m: float


@dataclass(frozen=True, kw_only=True)
class Joint:
    """One revolute joint and the link that it moves; the origin is relative to the frame before it (URDF's rule).

    `lower_rad` and `upper_rad` are None for a joint that turns without end. `link_hull_m`, where it is given, are the
    corners of a convex body that holds the link more closely than its capsule does: collisions are looked for with it.
    """

    name: str
    origin_xyz_m: Vector
    origin_rpy_rad: Vector
    axis: Vector
    lower_rad: float | None
    upper_rad: float | None
    max_velocity_rad_s: float
    max_acceleration_rad_s2: float
    max_jerk_rad_s3: float
    max_effort_nm: float
    link_mass_kg: float
    link_capsule: Capsule
    link_hull_m: tuple[Vector, ...] = ()


@dataclass(frozen=True, kw_only=True)
class ArmModel:
    """An arm with the plate mounted on it.

    `plate_xyz_m` and `plate_rpy_rad` place the plate frame in the flange frame; the pivot lies `pivot_above_plate_m`
    along the plate's normal. `home_rad` is a joint pose that holds the plate level, its axes along the
    world's when the base is turned by `home_yaw_rad`. `catalogue` is the arm's name among those that the IK library
    ships ready-made (empty: it is solved from the joints).
    """

    name: str
    source: str
    joints: tuple[Joint, ...]
    base_mass_kg: float
    base_capsule: Capsule
    flange_xyz_m: Vector
    flange_rpy_rad: Vector
    plate_xyz_m: Vector
    plate_rpy_rad: Vector
    pivot_above_plate_m: float
    home_rad: tuple[float, ...]
    home_yaw_rad: float = 0.0
    catalogue: str = ""

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, base first."""
        return tuple(joint.name for joint in self.joints)

    @cached_property
    def flange_from_plate(self) -> Array:
        """The transform (4, 4) from the plate's centre to the flange."""
        return transform(self.plate_xyz_m, self.plate_rpy_rad)

    @cached_property
    def plate_from_pivot(self) -> Array:
        """The pivot above the plate, axes parallel to the plate's, (4, 4)."""
        return transform((0.0, 0.0, self.pivot_above_plate_m), (0.0, 0.0, 0.0))

    @cached_property
    def flange_from_pivot(self) -> Array:
        """The centre of rotation on the flange, (4, 4)."""
        return self.flange_from_plate @ self.plate_from_pivot

    @cached_property
    def lower_rad(self) -> Array:
        """Lower limits, (n,); minus infinity where the joint turns without end."""
        return np.array([-np.inf if joint.lower_rad is None else joint.lower_rad for joint in self.joints])

    @cached_property
    def upper_rad(self) -> Array:
        """Upper limits, (n,); infinity where the joint turns without end."""
        return np.array([np.inf if joint.upper_rad is None else joint.upper_rad for joint in self.joints])

    @cached_property
    def max_velocity_rad_s(self) -> Array:
        """Speed limits, (n,)."""
        return np.array([joint.max_velocity_rad_s for joint in self.joints])

    @cached_property
    def max_acceleration_rad_s2(self) -> Array:
        """Acceleration limits, (n,)."""
        return np.array([joint.max_acceleration_rad_s2 for joint in self.joints])

    @cached_property
    def max_jerk_rad_s3(self) -> Array:
        """Jerk limits, (n,)."""
        return np.array([joint.max_jerk_rad_s3 for joint in self.joints])

    @cached_property
    def rodrigues(self) -> tuple[Array, Array, Array]:
        """The parts P, S, C, each (n, 4, 4), of joint i's transform P[i] + sin(q) S[i] + cos(q) C[i] (Rodrigues)."""
        fixed, sine, cosine = [], [], []
        for joint in self.joints:
            origin = transform(joint.origin_xyz_m, joint.origin_rpy_rad)
            x, y, z = joint.axis
            along, cross = np.zeros((4, 4)), np.zeros((4, 4))
            along[:3, :3] = np.outer(joint.axis, joint.axis)
            cross[:3, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
            fixed.append(origin @ (along + np.diag([0.0, 0.0, 0.0, 1.0])))
            sine.append(origin @ cross)
            cosine.append(origin @ (np.diag([1.0, 1.0, 1.0, 0.0]) - along))
        return np.array(fixed), np.array(sine), np.array(cosine)

    @cached_property
    def joint_axes(self) -> Array:
        """Axes of the joints in their own frames, homogeneous directions (n, 4)."""
        return np.array([(*joint.axis, 0.0) for joint in self.joints])

    @cached_property
    def last_from_pivot(self) -> Array:
        """The pivot in the frame of the last link, (4, 4)."""
        return self.last_from_flange @ self.flange_from_pivot

    @cached_property
    def last_from_flange(self) -> Array:
        """The flange in the frame of the last link, (4, 4)."""
        return transform(self.flange_xyz_m, self.flange_rpy_rad)


def transform(xyz_m: ArrayLike, rpy_rad: Vector) -> Array:
    """Returns the homogeneous (4, 4) transform with URDF's angles: Rz(yaw) Ry(pitch) Rx(roll)."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy_rad), np.cos(rpy_rad)
    result = np.eye(4)
    result[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    result[:3, 3] = xyz_m
    return result


def link_transforms(model: ArmModel, q: ArrayLike) -> Array:
    """Returns the frames of all links, base_from_link, (…, n, 4, 4), for the joint angles `q` in radians, (…, n)."""
    steps = joint_transforms(model, q)
    for i in range(1, len(model.joints)):
        steps[..., i, :, :] = steps[..., i - 1, :, :] @ steps[..., i, :, :]
    return steps


def joint_transforms(model: ArmModel, q: ArrayLike) -> Array:
    """Returns each link frame in the frame before it, (…, n, 4, 4), for the joint angles `q` in radians, (…, n)."""
    fixed, sine, cosine = model.rodrigues
    angles = np.asarray(q, dtype=np.float64)[..., None, None]
    return fixed + np.sin(angles) * sine + np.cos(angles) * cosine


def forward_kinematics(model: ArmModel, q: ArrayLike, *, world_from_base: Array | None = None) -> Array:
    """Returns world_from_flange, (4, 4), for joint angles `q` in radians, (n,).

    The base is the world unless `world_from_base` (4, 4) is given; its shift is in m.
    """
    pose = np.eye(4) if world_from_base is None else world_from_base
    for step in joint_transforms(model, q):
        pose = pose.dot(step)
    return pose.dot(model.last_from_flange)


def load_arm_model(name_or_path: str | Path) -> ArmModel:
    """Reads an arm's description: a name in `station/rig/models/` (such as jaco2_spherical) or a path to a TOML file.

    Raises UserError naming the file when it is missing or does not describe an arm.
    """
    path = Path(name_or_path)
    if path.suffix != ".toml":
        path = MODELS / f"{name_or_path}.toml"
    if not os.path.isfile(path):  # Path.is_file raises an OSError for a name that is too long
        known = ", ".join(sorted(entry.stem for entry in MODELS.glob("*.toml")))
        raise UserError(f"No arm model {str(name_or_path)[:80]!r}: expected a TOML file, or one of {known}.")
    try:
        return _arm(tomllib.loads(path.read_text(encoding="utf-8")))
    except KeyError as missing:
        raise UserError(
            f"The arm model {path} lacks the key {missing}: compare it with jaco2_spherical.toml."
        ) from None
    except (TypeError, ValueError) as wrong:
        raise UserError(f"The arm model {path} cannot be read: {wrong}.") from None


def _arm(table: dict[str, Any]) -> ArmModel:
    """Returns the model that a parsed file describes; KeyError, TypeError or ValueError when it is wrong."""
    joints = tuple(_joint(entry) for entry in table["joint"])
    home = tuple(float(angle) for angle in table["home_rad"])
    if len(home) != len(joints):
        raise ValueError(f"home_rad has {len(home)} angles for {len(joints)} joints")
    return ArmModel(
        name=str(table["name"]),
        source=str(table["source"]),
        joints=joints,
        base_mass_kg=float(table["base"]["mass_kg"]),
        base_capsule=_capsule(table["base"]),
        flange_xyz_m=_vector(table["flange"], "origin_xyz_m"),
        flange_rpy_rad=_vector(table["flange"], "origin_rpy_rad"),
        plate_xyz_m=_vector(table["tool"], "origin_xyz_m"),
        plate_rpy_rad=_vector(table["tool"], "origin_rpy_rad"),
        pivot_above_plate_m=float(table["tool"]["pivot_above_plate_m"]),
        home_rad=home,
        home_yaw_rad=math.radians(table.get("home_yaw_deg", 0.0)),
        catalogue=str(table.get("catalogue", "")),
    )


def _joint(entry: dict[str, Any]) -> Joint:
    axis = np.array(_vector(entry, "axis"))
    if not np.linalg.norm(axis) > 0:
        raise ValueError(f"the axis of {entry['name']} has no direction")
    return Joint(
        name=str(entry["name"]),
        origin_xyz_m=_vector(entry, "origin_xyz_m"),
        origin_rpy_rad=_vector(entry, "origin_rpy_rad"),
        axis=cast(Vector, tuple((axis / np.linalg.norm(axis)).tolist())),
        lower_rad=math.radians(entry["lower_deg"]) if "lower_deg" in entry else None,
        upper_rad=math.radians(entry["upper_deg"]) if "upper_deg" in entry else None,
        max_velocity_rad_s=_positive(entry, "max_velocity_deg_s", scale=math.pi / 180),
        max_acceleration_rad_s2=_positive(entry, "max_acceleration_deg_s2", scale=math.pi / 180),
        max_jerk_rad_s3=_positive(entry, "max_jerk_deg_s3", scale=math.pi / 180),
        max_effort_nm=_positive(entry, "max_effort_nm"),
        link_mass_kg=_positive(entry, "link_mass_kg"),
        link_capsule=_capsule(entry),
        link_hull_m=_hull(entry),
    )


def _hull(entry: dict[str, Any]) -> tuple[Vector, ...]:
    """Returns the corners of the link's hull, where one is given.

    Raises:
        ValueError: if they span no body.
    """
    corners = tuple(_vector({"hull_m": corner}, "hull_m") for corner in entry.get("hull_m", ()))
    if corners and np.linalg.matrix_rank(np.subtract(corners, corners[0]), tol=1e-6) < 3:
        raise ValueError(f"hull_m of {entry['name']} must be at least four corners that are not in one plane")
    return corners


def _capsule(entry: dict[str, Any]) -> Capsule:
    return Capsule(
        from_m=_vector(entry, "capsule_from_m"),
        to_m=_vector(entry, "capsule_to_m"),
        radius_m=_positive(entry, "capsule_radius_m"),
    )


def _vector(entry: dict[str, Any], key: str) -> Vector:
    values = [float(value) for value in entry[key]]
    if len(values) != 3 or not all(math.isfinite(value) for value in values):
        raise ValueError(f"{key} must be three finite numbers, not {entry[key]}")
    return (values[0], values[1], values[2])


def _positive(entry: dict[str, Any], key: str, *, scale: float = 1.0) -> float:
    value = float(entry[key])
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"{key} must be a positive number, not {value}")
    return value * scale
