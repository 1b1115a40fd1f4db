"""The arm's door to MuJoCo, which ships no types, and how a transform is written there."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Nothing is drawn with MuJoCo here; else it would look for a window library, in a process of its own.
os.environ.setdefault("MUJOCO_GL", "disable")

import mujoco

mj: Any = mujoco


def place(a_from_b: NDArray[np.float64]) -> dict[str, Any]:
    """Returns position, m, and quaternion of `a_from_b` (4, 4), as MuJoCo's `add_body` and `add_geom` take them."""
    quaternion = np.empty(4)
    mj.mju_mat2Quat(quaternion, np.ascontiguousarray(a_from_b[:3, :3]).ravel())
    return {"pos": a_from_b[:3, 3], "quat": quaternion}
