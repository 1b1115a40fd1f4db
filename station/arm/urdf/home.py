"""A home pose for an imported arm: the plate level, and as far to tilt in the four directions as can be found."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from shared.errors import UserError
from station.arm.collision import CollisionScene
from station.arm.kinematics import FULL, pivot_pose, spherical
from station.arm.planning import Pose, assess, search
from station.arm.tilt_path import tilt_stage
from station.rig.arm_model import ArmModel
from station.rig.arm_settings import ObstacleSettings
from station.rig.tilt import DIRECTIONS, azimuth_of_direction

_FOUR_RAD = np.array([azimuth_of_direction(number) for number in range(DIRECTIONS)])
_TURNS_RAD = tuple(np.radians(np.arange(0, 90, 15)).tolist())
_DECIMALS = 12
_ELSE = "give a pose that holds the plate level: --home-deg A,B,..."


@dataclass(frozen=True, kw_only=True)
class Homed:
    """A model with its home pose, and how far it tilts from there in the four directions."""

    model: ArmModel
    pose: Pose


def with_home(model: ArmModel, *, home_rad: Sequence[float] = ()) -> Homed:
    """Gives the model at home: where `home_rad` says, else where a search finds (an arm) or all angles are 0 (a stage).

    Raises:
        UserError: if no pose is found, or it does not hold the plate level.
    """
    try:
        if home_rad or len(model.joints) < FULL:
            return _placed(model, home_rad or model.home_rad)
        turns = (0.0,) if spherical(model) else _TURNS_RAD
        return _homed(model, search(model, obstacles=ObstacleSettings(), azimuths_rad=_FOUR_RAD, turns_rad=turns)[0])
    except UserError as refused:
        raise UserError(f"{str(refused).rstrip('.')}; {_ELSE}") from refused


def _placed(model: ArmModel, home_rad: Sequence[float]) -> Homed:
    """Returns the model in a pose near `home_rad`, its base turned so that the plate lies along the world's axes."""
    if len(home_rad) != len(model.joints):
        raise UserError(f"Expected {len(model.joints)} angles of the home pose, got {len(home_rad)}")
    pose = pivot_pose(model, np.array(home_rad))
    yaw = -math.atan2(pose[1, 0], pose[0, 0])
    stage = tilt_stage(model, base_xyz_m=(0, 0, 0), base_yaw_rad=yaw, home_rad=home_rad)
    scene = CollisionScene(model, world_from_base=stage.world_from_base, obstacles=ObstacleSettings())
    return _homed(model, assess(stage, scene=scene, azimuths_rad=_FOUR_RAD.tolist()))


def _homed(model: ArmModel, pose: Pose) -> Homed:
    base = pose.stage.world_from_base
    home = tuple(round(angle, _DECIMALS) + 0.0 for angle in pose.stage.home_rad.tolist())
    yaw = round(math.degrees(math.atan2(base[1, 0], base[0, 0])), _DECIMALS) + 0.0
    return Homed(model=replace(model, home_rad=home, home_yaw_rad=math.radians(yaw)), pose=pose)
