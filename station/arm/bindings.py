"""The arm's door to MuJoCo, which ships no types, and how a transform is written there."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

mj: Any = mujoco


def place(a_from_b: NDArray[np.float64]) -> dict[str, Any]:
    """Position and quaternion of the transform (4, 4), as MuJoCo's `add_body` and `add_geom` take them."""
    quaternion = np.empty(4)
    mj.mju_mat2Quat(quaternion, np.ascontiguousarray(a_from_b[:3, :3]).ravel())
    return {"pos": a_from_b[:3, 3], "quat": quaternion}
