"""The readings of the world: joints, the plate's pose, the block's pose on the plate."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

FLOATS = NDArray[np.float64]
LEAN_RAD = 0.04


class Bodies:
    """The poses in the world of the plate, and of the block as a part of it, as views of MuJoCo's memory.

    Places are (3,), the rotation is (9,), row by row.
    """

    def __init__(self, data: Any, *, plate: int, block: int) -> None:
        self.plate_place: FLOATS = data.xpos[plate]
        self.plate_rotation: FLOATS = data.xmat[plate]
        self.plate_quaternion: FLOATS = data.xquat[plate]
        self.block_place: FLOATS = data.xpos[block]


class Joints(NamedTuple):
    """The arm's joints: rad, rad/s, Nm; each (n,)."""

    position_rad: tuple[float, ...]
    velocity_rad_s: tuple[float, ...]
    effort_nm: tuple[float, ...]


class PlatePose(NamedTuple):
    """world_from_plate as a rotation, row by row, and a quaternion (w, x, y, z), and the pivot in the world (m).

    In plain numbers, because it is read hundreds of times a second; `rotation` and `pivot` give arrays.
    """

    rows: tuple[float, ...]
    quaternion: tuple[float, ...]
    pivot_m: tuple[float, float, float]

    @property
    def rotation(self) -> FLOATS:
        """The rotation matrix, (3, 3)."""
        return np.reshape(self.rows, (3, 3))

    @property
    def pivot(self) -> FLOATS:
        """The pivot, (3,)."""
        return np.array(self.pivot_m)


class Pose(NamedTuple):
    """plate_from_block: position in m and quaternion (w, x, y, z)."""

    position: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]

    @property
    def yaw_rad(self) -> float:
        """The block's turn about the plate's normal."""
        w, x, y, z = self.quaternion
        return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))

    @property
    def lean_rad(self) -> float:
        """The angle between the block's own z axis and the plate's normal."""
        w, x, y, z = self.quaternion
        return 2 * math.atan2(math.hypot(x, y), math.hypot(w, z))


def standing(pose: Pose, *, half_m: float) -> Pose:
    """Gives the pose that a block on hard feet would have: without the small lean that MuJoCo's soft contact gives it.

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


def plate_pose(bodies: Bodies, *, pivot_above_plate_m: float) -> PlatePose:
    """Returns the plate's pose and its pivot, which is `pivot_above_plate_m` along its normal."""
    rows, height = tuple(bodies.plate_rotation.tolist()), pivot_above_plate_m
    x, y, z = bodies.plate_place.tolist()
    pivot = (x + rows[2] * height, y + rows[5] * height, z + rows[8] * height)
    return PlatePose(rows, tuple(bodies.plate_quaternion.tolist()), pivot)
