"""An arm's model from a chain of a URDF. What the file does not say is estimated, and each estimate is noted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shared.errors import UserError
from station.arm.urdf.capsule import convex_corners, enclosing_capsule
from station.arm.urdf.chain import Body, Chain
from station.arm.urdf.hull import enclosing_hull
from station.arm.urdf.robot import UrdfJoint
from station.arm.urdf.shapes import Meshes, points_of
from station.rig.arm_model import ArmModel, Array, Capsule, Joint, Vector

_GRAVITY_M_S2 = 9.81
_DENSITY_KG_M3 = 1000.0
_RADIUS_M = 0.04
"""A link without geometry is as thick as a JACO's."""
_MOST_CORNERS = 20_000
"""A ball of 0.3 m with so many is round to 0.01 mm. The search for its hull takes 4 s; that of 300 000 took 160 s and
1.3 GB (tests/unit/arm/urdf/test_capsule.py makes such balls)."""
_SLOW_RAD_S = math.radians(30.0)
_ACCELERATION_RAD_S2 = math.radians(180.0)
"""A tilt needs little: gentle for an arm that carries a plate with a camera, and what the JACOs have."""
_RISE_S, _JERK_S = 0.2, 0.1
_ALWAYS = (
    "Estimated, because URDF says nothing of it: max_acceleration and max_jerk (those of the JACOs, or full speed "
    f"within {_RISE_S} s if that is less), the pivot's height."
)
_PIVOT_ABOVE_PLATE_M = 0.005  # the centre of mass of the 1 cm cube


@dataclass(frozen=True, kw_only=True)
class Drafted:
    """A model without a home pose (all angles 0); `notes` on what is estimated of all (""), the "base" and joints."""

    model: ArmModel
    notes: dict[str, tuple[str, ...]]


def draft(chain: Chain, meshes: Meshes, *, name: str, source: str) -> Drafted:
    """Returns the model of an arm whose plate is mounted at the tip, its normal along the tip's z.

    Raises:
        UserError: if geometry cannot be read, or a joint has no range.
    """
    ends = [*(origin for _, origin, _ in chain.steps[1:]), chain.last_from_tip]
    foot = _part(chain.foot, chain.steps[0][1], meshes)
    parts = [_part(body, end, meshes) for (_, _, body), end in zip(chain.steps, ends, strict=True)]
    beyond = _loads(chain, parts)
    joints = [
        _joint(joint, origin, part, torque_nm=torque)
        for (joint, origin, _), part, torque in zip(chain.steps, parts, beyond, strict=True)
    ]
    xyz, rpy = _origin(chain.last_from_tip)
    model = ArmModel(
        name=name, source=source, joints=tuple(made.joint for made in joints), base_mass_kg=foot.mass_kg,
        base_capsule=foot.capsule, flange_xyz_m=xyz, flange_rpy_rad=rpy, plate_xyz_m=(0.0, 0.0, 0.0),
        plate_rpy_rad=(0.0, 0.0, 0.0), pivot_above_plate_m=_PIVOT_ABOVE_PLATE_M, home_rad=(0.0,) * len(joints),
    )  # fmt: skip
    return Drafted(
        model=model, notes={"": (_ALWAYS,), "base": foot.notes} | {made.joint.name: made.notes for made in joints}
    )


@dataclass(frozen=True, kw_only=True)
class _Part:
    capsule: Capsule
    hull_m: tuple[Vector, ...]
    mass_kg: float
    notes: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class _Made:
    joint: Joint
    notes: tuple[str, ...]


def _part(body: Body, body_from_end: Array, meshes: Meshes) -> _Part:
    """Returns a body's capsule and mass; `body_from_end` is the next joint's place, for a body without geometry."""
    notes: list[str] = []
    points = points_of(body, meshes)
    if len(points):
        points = convex_corners(points)
        _require_coarse(points, body)
        capsule = enclosing_capsule(points)
    else:
        capsule = Capsule(from_m=(0.0, 0.0, 0.0), to_m=_beyond(body_from_end), radius_m=_RADIUS_M)
        notes.append(f"capsule: no geometry in the URDF; {_RADIUS_M * 1000:.0f} mm round the line to the next joint")
    mass = sum(link.mass_kg or 0.0 for link, _ in body.links)
    if not mass > 0:
        mass = round(_DENSITY_KG_M3 * _volume(capsule), 3)
        notes.append("mass: none in the URDF; the capsule's, as heavy as water")
    return _Part(capsule=capsule, hull_m=enclosing_hull(points), mass_kg=mass, notes=tuple(notes))


def _require_coarse(corners: Array, body: Body) -> None:
    if len(corners) > _MOST_CORNERS:
        names = ", ".join(link.name for link, _ in body.links)
        raise UserError(
            f"Expected a mesh whose convex hull has at most {_MOST_CORNERS} corners as link {names}, found "
            f"{len(corners)}; simplify it"
        )


def _beyond(body_from_end: Array) -> Vector:
    """Returns the next joint's place, or a millimetre along z where it is here: a capsule's line has a length."""
    xyz, _ = _origin(body_from_end)
    return xyz if math.hypot(*xyz) > 1e-3 else (0.0, 0.0, 1e-3)


def _volume(capsule: Capsule) -> float:
    return math.pi * capsule.radius_m**2 * (math.dist(capsule.from_m, capsule.to_m) + 4 / 3 * capsule.radius_m)


def _loads(chain: Chain, parts: Sequence[_Part]) -> list[float]:
    """Returns the torque (N m) that holds at each joint what lies beyond it, stretched out as far as it can be."""
    lengths = [float(np.linalg.norm(origin[:3, 3])) for _, origin, _ in chain.steps[1:]]
    loads: list[float] = []
    for first in range(len(parts)):
        reach = np.concatenate([[0.0], np.cumsum(lengths[first:])])
        far = zip(parts[first:], reach, strict=True)
        loads.append(_GRAVITY_M_S2 * sum(part.mass_kg * (away + _longest(part.capsule)) for part, away in far))
    return loads


def _longest(capsule: Capsule) -> float:
    """Returns the farthest that a capsule's centre line gets from its joint, m."""
    return max(math.hypot(*capsule.from_m), math.hypot(*capsule.to_m))


def _joint(joint: UrdfJoint, origin: Array, part: _Part, *, torque_nm: float) -> _Made:
    notes = list(part.notes)
    velocity = joint.max_velocity_rad_s or _SLOW_RAD_S
    if joint.max_velocity_rad_s is None:
        notes.append(f"max_velocity: none in the URDF; a slow {math.degrees(_SLOW_RAD_S):.0f} degrees/s")
    effort = joint.max_effort_nm or max(1.0, math.ceil(2 * torque_nm))
    if joint.max_effort_nm is None:
        notes.append("max_effort: none in the URDF; twice what holds the stretched arm")
    acceleration = min(velocity / _RISE_S, _ACCELERATION_RAD_S2)
    xyz, rpy = _origin(origin)
    lower, upper = _range(joint)
    made = Joint(
        name=joint.name, origin_xyz_m=xyz, origin_rpy_rad=rpy, axis=joint.axis, lower_rad=lower, upper_rad=upper,
        max_velocity_rad_s=velocity, max_acceleration_rad_s2=acceleration, max_jerk_rad_s3=acceleration / _JERK_S,
        max_effort_nm=effort, link_mass_kg=part.mass_kg, link_capsule=part.capsule,
        link_hull_m=part.hull_m,
    )  # fmt: skip
    return _Made(joint=made, notes=tuple(notes))


def _range(joint: UrdfJoint) -> tuple[float | None, float | None]:
    """Returns the joint's range; none for one that turns without end.

    A limit that is left out is 0, which is URDF's rule.

    Raises:
        UserError: if it is empty, or a speed or torque is negative.
    """
    if min(joint.max_velocity_rad_s or 1.0, joint.max_effort_nm or 1.0) <= 0:
        raise UserError(f"Expected a positive velocity and effort of the joint {joint.name!r} in the URDF")
    if joint.kind == "continuous":
        return None, None
    lower, upper = joint.lower_rad or 0.0, joint.upper_rad or 0.0
    if not lower < upper:
        raise UserError(
            f"Expected a range of the joint {joint.name!r} in the URDF, got {lower:g} to {upper:g} rad: give its "
            "<limit>, or make it continuous"
        )
    return lower, upper


def _origin(a_from_b: Array) -> tuple[Vector, Vector]:
    """Returns the place and URDF's angles (roll, pitch, yaw) of a transform (4, 4)."""
    x, y, z = (round(value, 12) + 0.0 for value in a_from_b[:3, 3].tolist())
    turn = a_from_b[:3, :3]
    flat = math.hypot(turn[0, 0], turn[1, 0])
    if flat > 1e-9:
        roll, yaw = math.atan2(turn[2, 1], turn[2, 2]), math.atan2(turn[1, 0], turn[0, 0])
    else:  # pitched by a right angle, roll and yaw are one
        roll, yaw = math.atan2(-turn[1, 2], turn[1, 1]), 0.0
    a, b, c = (round(value, 12) + 0.0 for value in (roll, math.atan2(-turn[2, 0], flat), yaw))
    return (x, y, z), (a, b, c)
