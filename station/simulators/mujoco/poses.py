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
