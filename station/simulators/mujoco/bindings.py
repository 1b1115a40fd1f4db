"""The door to MuJoCo: its compiled bindings carry no types, so what they return is annotated where it arrives."""

from typing import Any

import mujoco

mj: Any = mujoco
