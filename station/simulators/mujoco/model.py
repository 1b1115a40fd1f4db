"""The MuJoCo models of the twin: arm, plate, foam border, camera mount and block, built from the arm's description.

One model is the arm, on whose plate the block weighs as a part of it. A block that may slide is in a model of its own,
seen from the plate: there the plate rests, and what its motion does to the block is a part of gravity. Left out is what
its angular acceleration does to the block's turning, about a thousandth of what tips it, and the push of a sliding
block of some grams on an arm of many kilograms.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from station.rig.arm_model import ArmModel, transform
from station.simulators.mujoco.bindings import mj
from station.simulators.mujoco.contact import EXACT, Contact
from station.simulators.mujoco.specimen import Block, Plate

FLOATS = NDArray[np.float64]
FOOT_RADIUS_M = 0.0005
"""The block stands on eight small spheres, one at each corner: four analytic contacts instead of a box on a box."""
FOAM_DEPTH_M = 0.015
"""Half the thickness of a foam segment, its overlap with the next, and how far it reaches above and below the foam."""
FOAM_SEGMENTS = 24
FOAM_IMPEDANCE = 0.05
"""Constraint impedance of the foam: small, so that it is a spring beside the rigid contact, not a wall."""
SERVO_STIFFNESS = 2.0e4
SERVO_DAMPING = 400.0
GEAR_INERTIA = 1.0
"""The servo of each joint (Nm/rad, Nm s/rad) and the rotor inertia seen through the gear (kg m²): about 20 Hz, close
to critically damped, so that set-points are followed within milliseconds and nothing rings."""


@dataclass(frozen=True, kw_only=True)
class Scene:
    """The scene to build: the arm, where it stands (world_from_base, (4, 4)), and what lies on its plate."""

    arm: ArmModel
    world_from_base: FLOATS
    block: Block
    plate: Plate
    contact: Contact = EXACT
    step_s: float = 0.002
    """The block's time step."""
    arm_step_s: float = 0.01


def build_arm(scene: Scene) -> Any:
    """Builds the compiled MjModel of the arm, with plate, camera and block as parts of its last link.

    Its steps are implicit in the servos' damping: at 10 ms they err less than explicit ones of 2 ms.
    """
    spec = _spec(scene)
    spec.option.timestep = scene.arm_step_s
    spec.option.integrator = mj.mjtIntegrator.mjINT_IMPLICITFAST
    plate = _add_plate(_add_arm(spec, scene), scene)
    _add_camera(plate, scene.plate)
    _add_block(plate.add_body(name="block", pos=[0, 0, scene.block.side_m / 2]), scene.block)
    # Nothing can touch anything here, so MuJoCo need not look for it.
    spec.option.disableflags = mj.mjtDisableBit.mjDSBL_CONTACT | mj.mjtDisableBit.mjDSBL_CONSTRAINT
    return _bare(spec)


def build_block(scene: Scene, *, bordered: bool) -> Any:
    """Builds the compiled MjModel of a block that lies on a plate at rest by contact, in reach of the foam or not."""
    spec = _spec(scene)
    plate = spec.worldbody.add_body(name="plate")
    _add_plate_box(plate, scene.plate)
    if bordered:
        _add_foam(plate, scene.plate)
    block = spec.worldbody.add_body(name="block", pos=[0, 0, scene.block.side_m / 2])
    block.add_freejoint(name="block")
    _add_pairs(spec, scene, bordered=bordered)
    _add_block(block, scene.block)
    # One body is one island: looking for others takes a tenth of a step, and the result is the same, bit for bit.
    spec.option.disableflags = mj.mjtDisableBit.mjDSBL_ISLAND
    return spec.compile()


def _bare(spec: Any) -> Any:
    """Returns the compiled model without shapes, which give the bodies their inertia and then only cost time."""
    whole = spec.compile()
    for body in spec.bodies[1:]:
        number = whole.body(body.name).id
        body.mass, body.inertia = whole.body_mass[number], whole.body_inertia[number]
        body.ipos, body.iquat, body.explicitinertial = whole.body_ipos[number], whole.body_iquat[number], True
    for shape in [*spec.geoms, *spec.sites, *spec.cameras]:
        spec.delete(shape)
    return spec.compile()


def _spec(scene: Scene) -> Any:
    spec = mj.MjSpec()
    _options(spec, scene)
    return spec


def _options(spec: Any, scene: Scene) -> None:
    spec.modelname = f"repose twin, {scene.arm.name}"
    spec.option.timestep = scene.step_s
    spec.option.integrator = mj.mjtIntegrator.mjINT_EULER
    spec.option.cone = mj.mjtCone.mjCONE_ELLIPTIC if scene.contact.elliptic else mj.mjtCone.mjCONE_PYRAMIDAL
    spec.option.impratio = scene.contact.impratio
    # The solver stops by a share of the inertia, which for a block of some grams must be a small one.
    spec.option.tolerance = scene.contact.tolerance


def _add_arm(spec: Any, scene: Scene) -> Any:
    """Returns the chain of hinge joints with their servos; returns the last link's body."""
    arm = scene.arm
    base = scene.world_from_base
    body = spec.worldbody.add_body(name="base", pos=base[:3, 3], quat=quaternion(base[:3, :3]))
    _add_capsule(body, arm.base_capsule, arm.base_mass_kg)
    for joint in arm.joints:
        origin = transform(joint.origin_xyz_m, joint.origin_rpy_rad)
        body = body.add_body(name=joint.name, pos=origin[:3, 3], quat=quaternion(origin[:3, :3]), gravcomp=1)
        hinge = body.add_joint(name=joint.name, type=mj.mjtJoint.mjJNT_HINGE, axis=joint.axis, armature=GEAR_INERTIA)
        hinge.actfrclimited = True
        hinge.actfrcrange = [-joint.max_effort_nm, joint.max_effort_nm]
        hinge.actgravcomp = True
        _add_capsule(body, joint.link_capsule, joint.link_mass_kg)
    for joint in arm.joints:
        _add_spring(spec, joint.name)
    for joint in arm.joints:
        _add_damper(spec, joint.name)
    return body


def _add_spring(spec: Any, joint: str) -> None:
    """Adds the first actuator of a servo: it integrates the wanted velocity, and pulls towards that position.

    With the damper, which is driven by the wanted velocity as well, a set-point stream becomes straight ramps without
    stairs, and a steady ramp is followed without lag.
    """
    spring = spec.add_actuator(name=f"{joint} position", target=joint, trntype=mj.mjtTrn.mjTRN_JOINT)
    spring.dyntype = mj.mjtDyn.mjDYN_INTEGRATOR
    spring.gainprm[0] = SERVO_STIFFNESS
    spring.biastype = mj.mjtBias.mjBIAS_AFFINE
    spring.biasprm[1] = -SERVO_STIFFNESS


def _add_damper(spec: Any, joint: str) -> None:
    """Adds the second actuator of a servo: it damps the difference from the wanted velocity."""
    damper = spec.add_actuator(name=f"{joint} velocity", target=joint, trntype=mj.mjtTrn.mjTRN_JOINT)
    damper.gainprm[0] = SERVO_DAMPING
    damper.biastype = mj.mjtBias.mjBIAS_AFFINE
    damper.biasprm[2] = -SERVO_DAMPING


def _add_capsule(body: Any, capsule: Any, mass_kg: float) -> None:
    body.add_geom(
        type=mj.mjtGeom.mjGEOM_CAPSULE,
        fromto=[*capsule.from_m, *capsule.to_m],
        size=[capsule.radius_m, 0, 0],
        mass=mass_kg,
        rgba=[0.75, 0.75, 0.78, 1],
        **UNTOUCHABLE,
    )


def _add_plate(link: Any, scene: Scene) -> Any:
    """Returns the plate on the flange, with its fiducials; returns its body."""
    plate, arm = scene.plate, scene.arm
    pose = transform(arm.flange_xyz_m, arm.flange_rpy_rad) @ arm.flange_from_plate
    body = link.add_body(name="plate", pos=pose[:3, 3], quat=quaternion(pose[:3, :3]), gravcomp=1)
    _add_plate_box(body, plate)
    for number, (x, y) in enumerate(plate.fiducials_m):
        body.add_site(name=f"fiducial {number}", pos=[x, y, plate.foam_height_m], size=[0.002, 0.002, 0.0001])
    body.add_site(name="pivot", pos=[0, 0, arm.pivot_above_plate_m], size=[0.001, 0.001, 0.001])
    return body


def _add_plate_box(body: Any, plate: Plate) -> None:
    half, thick = plate.side_m / 2, plate.thickness_m / 2
    _add_box(body, "plate", (half, half, thick), (0, 0, -thick), mass_kg=plate.mass_kg, rgba=(0.8, 0.7, 0.5, 1))


def _add_foam(body: Any, plate: Plate) -> None:
    """Adds the border.

    It consists of straight segments round the cutout, with inner faces on its sides or tangent to its circle.

    MuJoCo pushes a ball out of a box through the nearest face. So the segments are thicker than any dent, and overlap
    by as much, lest a block that dents the foam be drawn outwards or along it; beyond its own sector a tangent lies
    outside of the cutout, so the overlap takes no room. They are higher and deeper than the foam by as much, too: a
    ball that dents one by more than half the foam's height would be pushed into the plate, and the block tipped over.
    """
    height, middle = plate.foam_height_m / 2 + FOAM_DEPTH_M, plate.foam_height_m / 2
    for number, side in enumerate(_foam_sides(plate)):
        x, y = side.x_m + FOAM_DEPTH_M * math.cos(side.angle_rad), side.y_m + FOAM_DEPTH_M * math.sin(side.angle_rad)
        sizes = (FOAM_DEPTH_M, side.half_m, height)
        geom = _add_box(body, f"foam {number}", sizes, (x, y, middle), rgba=(0.95, 0.95, 0.95, 1))
        geom.quat = [math.cos(side.angle_rad / 2), 0, 0, math.sin(side.angle_rad / 2)]


class _Side(NamedTuple):
    """A segment's inner face: its middle, half its length, and the direction outwards."""

    x_m: float
    y_m: float
    half_m: float
    angle_rad: float


def _foam_sides(plate: Plate) -> list[_Side]:
    """Returns the inner faces, which reach FOAM_DEPTH_M beyond their ends, except where the foam points inwards."""
    if not plate.cutout_outline_m:
        turn, radius = 2 * math.pi / FOAM_SEGMENTS, plate.cutout_radius_m
        half = radius * math.tan(turn / 2) + FOAM_DEPTH_M
        angles = [number * turn for number in range(FOAM_SEGMENTS)]
        return [_Side(radius * math.cos(angle), radius * math.sin(angle), half, angle) for angle in angles]
    corner = np.array(plate.cutout_outline_m)
    before, after = np.roll(corner, 1, axis=0), np.roll(corner, -1, axis=0)
    if float((corner[:, 0] * after[:, 1] - corner[:, 1] * after[:, 0]).sum()) < 0.0:
        corner, before, after = corner[::-1], after[::-1], before[::-1]
    (in_x, in_y), (out_x, out_y) = (corner - before).T, (after - corner).T
    more = np.where(in_x * out_y - in_y * out_x > 0.0, FOAM_DEPTH_M, 0.0)
    length = np.hypot(out_x, out_y)
    along = np.column_stack([out_x, out_y]) / length[:, None]
    begin, end = corner - more[:, None] * along, after + np.roll(more, -1)[:, None] * along
    middle, half = 0.5 * (begin + end), 0.5 * np.linalg.norm(end - begin, axis=1)
    outward = np.arctan2(-along[:, 0], along[:, 1])
    return [
        _Side(x, y, reach, angle)
        for (x, y), reach, angle in zip(middle.tolist(), half.tolist(), outward.tolist(), strict=True)
    ]


def _add_camera(body: Any, plate: Plate) -> None:
    """Adds two posts and a bar that carry the camera at a fixed offset above the plate (Fig. 2a)."""
    half, top = plate.side_m / 2, plate.camera_height_m
    for number, x in enumerate((-half, half)):
        post, position = (0.003, 0.003, top / 2), (x, half, top / 2)
        _add_box(body, f"post {number}", post, position, mass_kg=0.005, rgba=(0.6, 0.45, 0.3, 1))
    bar, position = (half, half / 2, 0.004), (0, half / 2, top)
    _add_box(body, "camera mount", bar, position, mass_kg=plate.camera_mass_kg, rgba=(0.3, 0.3, 0.3, 1))
    body.add_camera(name="camera", pos=[0, 0, top], fovy=45)


def _add_block(body: Any, block: Block) -> None:
    """Adds the cube: its inertia, its looks, its eight feet and the four bumpers that meet the foam at mid-height."""
    half = block.side_m / 2
    body.mass, body.inertia = block.mass_kg, [block.mass_kg * block.side_m**2 / 6] * 3
    body.ipos, body.iquat, body.explicitinertial = [0, 0, 0], [1, 0, 0, 0], True
    _add_box(body, "block", (half, half, half), (0, 0, 0), rgba=(0.5, 0.5, 0.55, 1))
    _add_box(body, "mark", (0.8 * half, 0.8 * half, 1e-5), (0, 0, half), rgba=(0.05, 0.05, 0.2, 1))
    body.add_site(name="mark", pos=[0, 0, half])
    for number, (x, y, z) in enumerate((x, y, z) for z in (-1, 1) for x in (-1, 1) for y in (-1, 1)):
        _add_ball(body, f"foot {number}", (x * half, y * half, z * (half - FOOT_RADIUS_M)))
    inset = half - FOOT_RADIUS_M / math.sqrt(2)
    for number, (x, y) in enumerate((x, y) for x in (-1, 1) for y in (-1, 1)):
        _add_ball(body, f"bumper {number}", (x * inset, y * inset, 0))


def _add_pairs(spec: Any, scene: Scene, *, bordered: bool) -> None:
    contact = scene.contact
    for foot in range(8):
        pair = spec.add_pair(name=f"foot {foot}", geomname1="plate", geomname2=f"foot {foot}", condim=3)
        pair.solref, pair.solimp, pair.solreffriction = contact.solref, contact.solimp, contact.solref_friction
    if not bordered:
        return
    solref, mu = _foam(scene), scene.plate.foam_mu
    for bumper in range(4):
        for segment in range(len(_foam_sides(scene.plate))):
            pair = spec.add_pair(geomname1=f"foam {segment}", geomname2=f"bumper {bumper}", condim=3)
            pair.solref, pair.friction = solref, [mu, mu, 0.005, 1e-4, 1e-4]
            pair.solreffriction = scene.contact.solref_friction
            pair.solimp = [FOAM_IMPEDANCE, FOAM_IMPEDANCE, 0.001, 0.5, 2]


def _foam(scene: Scene) -> list[float]:
    """Returns MuJoCo's direct solref of a spring and damper between the block and the foam.

    With constant impedance d MuJoCo scales the two by 1 / d, and the constraint acts as the acceleration
    −d (b v / d + k r / d) of the block; so the wanted stiffness K and damping 2 z sqrt(K m) give k = K / m and
    b = 2 z sqrt(K / m).
    """
    plate, mass = scene.plate, scene.block.mass_kg
    stiffness = plate.foam_stiffness_n_m / mass
    damping = 2 * plate.foam_damping * math.sqrt(plate.foam_stiffness_n_m / mass)
    return [-stiffness, -damping]


def _add_box(body: Any, name: str, half: Any, pos: Any, *, rgba: Any, mass_kg: float = 0.0) -> Any:
    return body.add_geom(
        name=name, type=mj.mjtGeom.mjGEOM_BOX, size=half, pos=pos, mass=mass_kg, rgba=rgba, **UNTOUCHABLE
    )


def _add_ball(body: Any, name: str, pos: Any) -> None:
    size = [FOOT_RADIUS_M, 0, 0]
    body.add_geom(name=name, type=mj.mjtGeom.mjGEOM_SPHERE, size=size, pos=pos, mass=0.0, **UNTOUCHABLE)


# Only the explicit pairs collide; a geom's own friction would otherwise be combined by MuJoCo's rule (the maximum).
UNTOUCHABLE = cast("dict[str, Any]", {"contype": 0, "conaffinity": 0})


def quaternion(rotation: FLOATS) -> FLOATS:
    """Returns the unit quaternion (4,), in the order (w, x, y, z), of a rotation matrix, (3, 3)."""
    result = np.empty(4)
    mj.mju_mat2Quat(result, np.ascontiguousarray(rotation, dtype=np.float64).ravel())
    return result


def reach_m(arm: ArmModel) -> FLOATS:
    """Returns an upper bound of the distance from each joint's axis to the block, (n,), m."""
    spans = [math.hypot(*joint.origin_xyz_m) for joint in arm.joints[1:]]
    spans.append(math.hypot(*arm.flange_xyz_m) + math.hypot(*arm.plate_xyz_m) + 0.1)
    return np.cumsum(spans[::-1])[::-1].copy()
