"""The abilities of an arm where it stands: reach, margins, speeds and torques by azimuth, and better places for it."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shared.errors import UserError
from station.arm.collision import CollisionScene
from station.arm.kinematics import FULL, arm_length_m
from station.arm.search import Candidates, evaluate, home_poses
from station.arm.tilt_path import MAX_ANGLE_RAD, TiltPath, TiltStage, tilt_path, tilt_stage
from station.arm.tilter import settled_model, settled_stage
from station.rig.arm_model import ArmModel, transform
from station.rig.arm_settings import ArmSettings, ObstacleSettings
from station.rig.tilt import azimuth_of_direction

Array = NDArray[np.float64]
_EVERY = 4  # one of so many knots is looked at for margins: 4 degrees
_ELSEWHERE = "look for another pose: station arm plan --search"
_ROUNDING_RAD = math.radians(0.01)


@dataclass(frozen=True, slots=True, kw_only=True)
class Reach:
    """One azimuth: the steepest angle, what ends it, and the margins on the way there.

    `joint_margin_rad` to the nearest joint limit; `clearance_m` between the closest `parts`; `rate_rad_s`, the
    fastest tilt that the joints' speeds allow; `torque_share`, the largest holding torque over its limit.
    """

    azimuth_rad: float
    angle_rad: float
    limit: str
    joint_margin_rad: float
    clearance_m: float
    parts: str
    rate_rad_s: float
    torque_share: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Pose:
    """A place and home pose of an arm, and its reach at every azimuth asked for."""

    stage: TiltStage
    reaches: tuple[Reach, ...]

    @property
    def worst_rad(self) -> float:
        """The largest angle that is reached at every azimuth."""
        return min(reach.angle_rad for reach in self.reaches)

    @property
    def comfort(self) -> float:
        """A figure of merit beyond the reach: margins in joints (rad), in distance (50 mm count as 0.5)."""
        joints = min(reach.joint_margin_rad for reach in self.reaches)
        room = min(reach.clearance_m for reach in self.reaches)
        return min(joints, 0.5) + min(10 * room, 0.5)


def assess(stage: TiltStage, *, scene: CollisionScene, azimuths_rad: Iterable[float]) -> Pose:
    """Returns the reach of an arm as it stands, at each azimuth."""
    reaches = tuple(_reach(stage, scene, azimuth) for azimuth in azimuths_rad)
    return Pose(stage=stage, reaches=reaches)


def _reach(stage: TiltStage, scene: CollisionScene, azimuth_rad: float) -> Reach:
    try:
        path = tilt_path(stage, azimuth_rad=azimuth_rad, touching=scene.touching)
    except UserError as refused:
        nothing = scene.clearance(stage.home_rad)
        return Reach(
            azimuth_rad=azimuth_rad, angle_rad=0.0, limit=str(refused), joint_margin_rad=0.0,
            clearance_m=nothing.distance_m, parts=nothing.parts, rate_rad_s=0.0, torque_share=1.0,
        )  # fmt: skip
    looked_at = np.vstack([path.joints_rad[::_EVERY], path.joints_rad[-1:]])
    nearest = min((scene.clearance(q) for q in looked_at), key=lambda clearance: clearance.distance_m)
    return Reach(
        azimuth_rad=azimuth_rad,
        angle_rad=path.reach_rad,
        limit=path.limit,
        joint_margin_rad=_joint_margin(stage.model, path.joints_rad),
        clearance_m=nearest.distance_m,
        parts=nearest.parts,
        rate_rad_s=_fastest(stage.model, path),
        torque_share=_torque_share(stage.model, scene, looked_at),
    )


def _joint_margin(model: ArmModel, joints_rad: Array) -> float:
    return float(np.minimum(joints_rad - model.lower_rad, model.upper_rad - joints_rad).min())


def _fastest(model: ArmModel, path: TiltPath) -> float:
    if not path.reach_rad:
        return 0.0
    return float(np.min(model.max_velocity_rad_s / np.maximum(np.abs(path.slopes).max(axis=0), 1e-9)))


def _torque_share(model: ArmModel, scene: CollisionScene, joints_rad: Array) -> float:
    limits = np.array([joint.max_effort_nm for joint in model.joints])
    return max(float(np.max(np.abs(scene.holding_torque_nm(q)) / limits)) for q in joints_rad)


# --- is a session possible? -------------------------------------------------------------------------------------------


def require_reach(pose: Pose, *, angle_rad: float, directions: Sequence[int] = ()) -> None:
    """Refuses a session whose plan tilts to `angle_rad` where the arm cannot.

    `directions` names the reaches in the sentence (0 to 3, in the order of the pose); without it they are azimuths.
    Raises UserError naming the first unreachable step and the best alternative.
    """
    for index, reach in enumerate(pose.reaches):
        if reach.angle_rad >= angle_rad - _ROUNDING_RAD:
            continue
        where = f"direction {directions[index]}, " if directions else ""
        raise UserError(
            f"The plan tilts to {_deg(angle_rad)} degrees in {where}azimuth {_deg(reach.azimuth_rad)}, but the arm "
            f"reaches {_deg(reach.angle_rad)} there: {reach.limit}. {_alternative(pose, directions, angle_rad)}"
        )


def require_session(settings: ArmSettings, *, angle_rad: float, directions: Sequence[int]) -> None:
    """Calls `require_reach` for the `[arm]` table of a rig and the directions of a plan.

    Raises UserError as `require_reach` does.
    """
    model = settled_model(settings)
    stage = settled_stage(settings, model)
    scene = CollisionScene(model, world_from_base=stage.world_from_base, obstacles=settings.obstacles)
    pose = assess(stage, scene=scene, azimuths_rad=[azimuth_of_direction(number) for number in directions])
    require_reach(pose, angle_rad=angle_rad, directions=directions)


def _alternative(pose: Pose, directions: Sequence[int], angle_rad: float) -> str:
    best = max(range(len(pose.reaches)), key=lambda index: pose.reaches[index].angle_rad)
    reach = pose.reaches[best]
    name = f"direction {directions[best]}" if directions else f"azimuth {_deg(reach.azimuth_rad)}"
    if reach.angle_rad >= angle_rad - _ROUNDING_RAD:
        how = f" (plan: [direction] some = [{directions[best]}])" if directions else ""
        return f"Tilt in {name} alone{how} and turn the sample between runs, or {_ELSEWHERE}."
    steepest = f"tilt in {name} alone, to {_deg(reach.angle_rad)} degrees, and turn the sample between runs"
    return f"No direction reaches it; {steepest}, or {_ELSEWHERE}."


def _deg(angle_rad: float) -> str:
    return f"{math.degrees(angle_rad):.1f}"


# --- where would it be better? ----------------------------------------------------------------------------------------

# Places of the pivot for an arm that is a metre long from its third axis on, as a JACO is; a longer one has more room.
_DISTANCES = np.arange(0.2, 0.65, 0.04)
_HEIGHTS = np.arange(0.3, 0.95, 0.04)
_FINE = np.array([-0.02, 0.0, 0.02])
_LOOKED_AT = 20  # candidates that are looked at for each that is assessed


def search(
    model: ArmModel,
    *,
    obstacles: ObstacleSettings,
    azimuths_rad: Array,
    turns_rad: Sequence[float] = (0.0,),
    keep: int = 40,
) -> list[Pose]:
    """Returns the best poses of the arm with its base at the world's origin, best first.

    A grid over distance and height of the pivot, the turns of the plate and all branches; then a finer grid round the
    best; then the surroundings, roughly at first. A spherical wrist turns the plate by its last joint alone: one
    turn is enough.
    A pose is as good as its reach at the azimuths `azimuths_rad` (a,), rad in the plate's frame.
    Raises UserError for a stage, which has no other pose.
    """
    if len(model.joints) < FULL:
        raise UserError(
            f"Expected an arm of {FULL} joints to search poses for; {model.name} is a stage and has one pose."
        )
    ranked = functools.partial(_ranked, model, turns_rad=turns_rad, azimuths_rad=azimuths_rad, obstacles=obstacles)
    clearest = functools.partial(_clearest, model, obstacles=obstacles, keep=keep // 2)
    long_m = arm_length_m(model)
    coarse = ranked(distances_m=long_m * _DISTANCES, heights_m=long_m * _HEIGHTS)
    distance, _, height = coarse.pivots_m[clearest(coarse)[0]]
    fine = ranked(distances_m=distance + long_m * _FINE, heights_m=height + long_m * _FINE)
    stages = [stage for found in (coarse, fine) for index in clearest(found) for stage in _stages(model, found, index)]
    poses = [_assess_alone(stage, obstacles, azimuths_rad) for stage in stages]
    return sorted(poses, key=lambda pose: (-round(pose.worst_rad, 3), -pose.comfort))


def _ranked(
    model: ArmModel,
    *,
    distances_m: Array,
    heights_m: Array,
    turns_rad: Sequence[float],
    azimuths_rad: Array,
    obstacles: ObstacleSettings,
) -> Candidates:
    joints, pivots, turns = home_poses(model, distances_m=distances_m, heights_m=heights_m, turns_rad=turns_rad)
    scenes = {turn: _scene(model, obstacles, base_yaw_rad=-turn) for turn in set(turns.tolist())}
    clear = [not scenes[turn].touching(q) for q, turn in zip(joints, turns.tolist(), strict=True)]
    if not any(clear):
        raise UserError(f"{model.name} can hold the plate level, touching nothing, nowhere in the places searched.")
    poses = (joints[clear], pivots[clear], turns[clear])
    return evaluate(model, poses, azimuths_rad=azimuths_rad, max_angle_rad=MAX_ANGLE_RAD)


def _clearest(model: ArmModel, found: Candidates, *, obstacles: ObstacleSettings, keep: int) -> list[int]:
    """Gives the best candidates, those first that tilt farthest at their worst azimuth before they touch something."""
    scenes = {turn: _scene(model, obstacles, base_yaw_rad=-turn) for turn in set(found.turns_rad.tolist())}
    best = found.best(_LOOKED_AT * keep).tolist()
    clear = {index: _clear_rad(found, index, scenes[float(found.turns_rad[index])]) for index in best}
    return sorted(best, key=lambda index: -round(clear[index], 6))[:keep]


def _clear_rad(found: Candidates, index: int, scene: CollisionScene) -> float:
    """Returns the tilt that a candidate reaches at its worst azimuth before a touch, as far as is looked at."""
    reach = found.reach_rad[index].copy()
    for column, way in enumerate(found.ways_rad[index]):
        touched = next((look for look, q in zip(found.looks_rad, way, strict=True) if scene.touching(q)), math.inf)
        reach[column] = min(reach[column], touched)
    return float(reach.min())


def _scene(model: ArmModel, obstacles: ObstacleSettings, *, base_yaw_rad: float) -> CollisionScene:
    world_from_base = transform((0.0, 0.0, 0.0), (0.0, 0.0, base_yaw_rad))
    return CollisionScene(model, world_from_base=world_from_base, obstacles=obstacles)


def _stages(model: ArmModel, found: Candidates, index: int) -> list[TiltStage]:
    """Returns the candidate as a stage: the base is turned so that the plate's axes are the world's."""
    turn = float(found.turns_rad[index])
    return [tilt_stage(model, base_xyz_m=(0, 0, 0), base_yaw_rad=-turn, home_rad=found.joints_rad[index])]


def _assess_alone(stage: TiltStage, obstacles: ObstacleSettings, azimuths_rad: Array) -> Pose:
    scene = CollisionScene(stage.model, world_from_base=stage.world_from_base, obstacles=obstacles)
    return assess(stage, scene=scene, azimuths_rad=azimuths_rad.tolist())
