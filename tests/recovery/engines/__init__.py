"""Other people's simulators behind the same few words: load exported files, turn gravity, say where the object is.

An engine is one file with `NAME`, `MODULE` (what must be installed), `FORMAT` and
`load(folder, stem, *, object_yaw_rad) -> Bench`.
"""

from __future__ import annotations

import importlib
import pkgutil
from pathlib import Path
from typing import Protocol, cast

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Bench(Protocol):
    """A plate and an object in an engine. Gravity is set in the frame of the measured body (`fixed_in`)."""

    step_s: float

    def advance(self, gravity_m_s2: Array) -> None:
        """One time step under this gravity (3)."""
        ...

    def place_m(self) -> Array:
        """Returns the object's place (3,), m; any frame that stands still."""
        ...

    def close(self) -> None:
        """Frees the engine."""
        ...


class Engine(Protocol):
    """One file of this folder."""

    NAME: str
    MODULE: str
    FORMAT: str
    ANISOTROPIC: bool
    """True if the engine knows friction by direction."""

    def load(self, folder: Path, stem: str, *, object_yaw_rad: float = 0.0) -> Bench:
        """Loads what was exported; the object is turned about z before it is put down."""
        ...


def engines() -> dict[str, Engine]:
    """Every engine by name; its library may be missing."""
    modules = (importlib.import_module(f"{__name__}.{found.name}") for found in pkgutil.iter_modules(__path__))
    found = [cast(Engine, module) for module in modules if hasattr(module, "FORMAT")]
    return {each.NAME: each for each in found}
