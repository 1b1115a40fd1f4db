"""What is read from the world: joints, the plate's pose, the block's pose on the plate."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from station.simulators.mujoco.bindings import mj
from station.simulators.mujoco.engine import Engine

FLOATS = NDArray[np.float64]
LEAN_RAD = 0.04


@dataclass(frozen=True, slots=True)
class Joints:
    """The arm's joints: rad, rad/s, Nm; each (n,)."""

    position_rad: tuple[float, ...]
    velocity_rad_s: tuple[float, ...]
    effort_nm: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class PlatePose:
    """world_from_plate as a rotation matrix (3, 3) and a quaternion (w, x, y, z), and the pivot in the world (m)."""

    rotation: FLOATS
    quaternion: tuple[float, ...]
    pivot: FLOATS


@dataclass(frozen=True, slots=True)
class Pose:
    """plate_from_block: position in m and quaternion (w, x, y, z)."""

    position: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]

    @property
    def yaw_rad(self) -> float:
        """The block's turn about the plate's normal."""
        w, x, y, z = self.quaternion
        return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def standing(pose: Pose, *, half_m: float) -> Pose:
    """The pose that a block on hard feet would have: without the small lean that MuJoCo's soft contact gives it.

    On a slope the feet sink in unevenly by a tenth of a millimetre, so the block leans by up to 40 milliradians
    about its base, which a real block of steel or wood does not. The base stays where it is. A lean beyond `LEAN_RAD`
    is more and more a motion of the block (it tips), and from three times as much on wholly.
    """
    w, x, y, z = pose.quaternion
    level = math.hypot(w, z)
    lean = 2 * math.atan2(math.hypot(x, y), level)
    if lean > 3 * LEAN_RAD or level == 0.0:
        return pose
    share = min(1.0, (3 - lean / LEAN_RAD) / 2)
    cw, cz = w / level, z / level
    ux, uy = 2 * (x * z + w * y), 2 * (y * z - w * x)  # the block's own z axis in the plate
    px, py, pz = pose.position
    shift = share * half_m
    position = (px - shift * ux, py - shift * uy, pz + share * (half_m - pz))
    w, x, y, z = w + share * (cw - w), (1 - share) * x, (1 - share) * y, z + share * (cz - z)
    length = math.sqrt(w * w + x * x + y * y + z * z)
    return Pose(position, (w / length, x / length, y / length, z / length))


def relative_pose(data: Any, engine: Engine) -> Pose:
    """plate_from_block from `data`, the bodies' poses in the world."""
    plate, block = engine.plate, engine.block
    place: FLOATS = data.xmat[plate].reshape(3, 3).T @ (data.xpos[block] - data.xpos[plate])
    inverse, turn = np.empty(4), np.empty(4)
    mj.mju_negQuat(inverse, data.xquat[plate])
    mj.mju_mulQuat(turn, inverse, data.xquat[block])
    x, y, z = place.tolist()
    w, i, j, k = (turn if turn[0] >= 0 else -turn).tolist()
    return Pose((x, y, z), (w, i, j, k))
