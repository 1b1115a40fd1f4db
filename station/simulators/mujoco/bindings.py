"""The door to MuJoCo: its compiled bindings carry no types, so what they return is annotated where it arrives."""

import ctypes
import os
from pathlib import Path
from typing import Any

# Nothing is drawn with MuJoCo here; else it would look for a window library, in a process of its own.
os.environ.setdefault("MUJOCO_GL", "disable")

import mujoco

mj: Any = mujoco


def _stop_the_stopwatch() -> None:
    """Takes out the clock that MuJoCo's Python package installs for `MjData.timer`, which nobody reads here.

    It is read some twenty times in every step, which is a fifth of the step of a model as small as these. The package's
    own `set_mjcb_time(None)` puts it back; in C the callback is a variable, null where no timing is wanted.
    """
    for library in Path(mujoco.__file__).parent.glob("libmujoco.*"):
        ctypes.c_void_p.in_dll(ctypes.CDLL(str(library)), "mjcb_time").value = None


_stop_the_stopwatch()
