"""Block and plate of a user's scene: where they are, what they touch each other with, and the block's pose."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from shared.errors import UserError
from station.physics.contact import Array
from station.simulators.mujoco.bindings import mj
from station.simulators.planar.plate import Index
from station.simulators.scene.keys import Keys, keys_beside


class Scene:
    """A compiled scene with its state, and the block on its plate."""

    def __init__(self, path: Path) -> None:
        """Reads the scene and the keys beside it.

        Raises:
            UserError: if it cannot be read, lacks a body that is named, or has a plate that is not fixed.
        """
        keys = keys_beside(path)
        try:
            self.model = mj.MjModel.from_xml_path(str(path))
        except (ValueError, OSError) as error:
            reason = " ".join(str(error).split())
            raise UserError(f"Expected a MuJoCo scene in {path}, but it cannot be read: {reason}") from error
        self.data = mj.MjData(self.model)
        self.block = self._named(mj.mjtObj.mjOBJ_BODY, keys.block, path, "block")
        joint = int(self.model.body_jntadr[self.block])
        if joint < 0 or self.model.jnt_type[joint] != mj.mjtJoint.mjJNT_FREE:
            raise UserError(
                f"Expected a free joint at the body {keys.block} of {path}, found none: the block must slide"
            )
        self.qpos = slice(int(self.model.jnt_qposadr[joint]), int(self.model.jnt_qposadr[joint]) + 7)
        self.qvel = slice(int(self.model.jnt_dofadr[joint]), int(self.model.jnt_dofadr[joint]) + 6)
        plate = self._plate(keys, path)
        mj.mj_forward(self.model, self.data)
        self.origin, self.turn = self._frame(plate, keys)
        self.first = self.data.qpos.copy()
        """The scene as it was written, in MuJoCo's coordinates."""
        self.touching = self._geoms(plate)
        self.foot = np.zeros(3)
        """The point of the block, in its own frame, whose place is read: see `stand`."""
        self.mass_kg = float(self.model.body_subtreemass[self.block])

    def _named(self, kind: Any, name: str, path: Path, key: str) -> int:
        found = int(mj.mj_name2id(self.model, kind, name))
        if found < 0:
            there = ", ".join(filter(None, (self.model.body(one).name for one in range(self.model.nbody))))
            raise UserError(
                f"Expected the body {name} in {path} (key {key} in {path.with_suffix('.toml').name}), "
                f"found the bodies {there}"
            )
        return found

    def _plate(self, keys: Keys, path: Path) -> int:
        """Returns the body of the plate, or of the geom that is the plate."""
        geom = int(mj.mj_name2id(self.model, mj.mjtObj.mjOBJ_GEOM, keys.plate))
        body = int(mj.mj_name2id(self.model, mj.mjtObj.mjOBJ_BODY, keys.plate))
        plate = body if body >= 0 or geom < 0 else int(self.model.geom_bodyid[geom])
        plate = plate if plate >= 0 else self._named(mj.mjtObj.mjOBJ_BODY, keys.plate, path, "plate")
        if self.model.body_weldid[plate] != 0:
            raise UserError(
                f"Expected the plate {keys.plate} of {path} fixed to the world, but it has joints: remove them, "
                "because gravity is turned instead of the plate"
            )
        return plate

    def _frame(self, plate: int, keys: Keys) -> tuple[Array, Array]:
        """Returns origin (3,) and rotation (3, 3) of the plate's frame in the world: the body's, or its geom's."""
        body = int(mj.mj_name2id(self.model, mj.mjtObj.mjOBJ_BODY, keys.plate))
        place, turn = (
            (self.data.xpos[plate], self.data.xmat[plate])
            if body >= 0
            else (self.data.geom(keys.plate).xpos, self.data.geom(keys.plate).xmat)
        )
        return place.copy(), turn.reshape(3, 3).copy()

    def _geoms(self, plate: int) -> tuple[Index, Index]:
        """Returns the geoms (g,) of block and plate, and the explicit pairs (p,) that one of the block's is in."""
        of_body = self.model.geom_bodyid
        mine = np.flatnonzero(self.model.body_rootid[of_body] == self.model.body_rootid[self.block])
        theirs = np.flatnonzero(of_body == plate)
        pairs = np.flatnonzero(np.isin(self.model.pair_geom1, mine) | np.isin(self.model.pair_geom2, mine))
        return np.concatenate([mine, theirs]), pairs

    def lay(self, x_m: float, y_m: float, yaw_rad: float, velocity: tuple[float, float, float]) -> None:
        """Lays the block at a pose in the plate's frame, at the height and with the face down that the scene has."""
        self.data.qpos[:], self.data.qvel[:] = self.first, 0.0
        mj.mj_forward(self.model, self.data)
        z = float(self.turn.T[2] @ (self.data.xpos[self.block] - self.origin))
        quaternion = np.empty(4)
        about = yaw_rad - self.pose()[2]
        normal = self.turn[:, 2]
        turned = np.array([math.cos(0.5 * about), *(math.sin(0.5 * about) * normal)])
        mj.mju_mulQuat(quaternion, turned, self.first[self.qpos][3:])
        self.data.qpos[self.qpos] = [*(self.origin + self.turn @ [x_m, y_m, z]), *quaternion]
        vx, vy, spin = velocity
        along = self.turn @ [vx, vy, 0.0]
        mj.mj_kinematics(self.model, self.data)
        about_body = self.data.xmat[self.block].reshape(3, 3).T @ (spin * normal)
        self.data.qvel[self.qvel] = [*along, *about_body]
        self.data.qacc_warmstart[:] = 0.0

    def stand(self) -> None:
        """Reads the block from now on at the point that is on the plate now, below its middle.

        A soft contact lets a block lean by some 10 mrad on a slope, which moves its middle by 0.05 mm and its foot
        hardly: a block on a hard plate does not lean.
        """
        turned = self.data.xmat[self.block].reshape(3, 3)
        height = float(self.turn[:, 2] @ (self.data.xpos[self.block] - self.origin))
        self.foot = turned.T @ (-height * self.turn[:, 2])

    def pose(self) -> tuple[float, float, float]:
        """Returns x, y (m) and heading (rad) of the block in the plate's frame."""
        turned = self.data.xmat[self.block].reshape(3, 3)
        x, y, _ = self.turn.T @ (self.data.xpos[self.block] + turned @ self.foot - self.origin)
        ahead = self.turn.T @ turned[:, 0]
        return float(x), float(y), math.atan2(ahead[1], ahead[0])

    def velocity(self) -> tuple[float, float]:
        """Returns the block's velocity along the plate, m/s."""
        vx, vy, _ = self.turn.T @ self.data.qvel[self.qvel][:3]
        return float(vx), float(vy)
