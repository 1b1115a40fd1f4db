"""A MuJoCo scene: gravity turns in it as the plate was recorded to tilt, and the block's path is read."""

from __future__ import annotations

from pathlib import Path

from shared.errors import UserError
from station.simulators.scene.refined import of_scene
from station.simulators.simulator import Simulator


def opened(path: Path, part: str, *, limit_s: float) -> Simulator:
    """Returns the simulator of a scene; nothing of the user's runs in it, so it needs no limit, and it has no parts.

    Raises:
        UserError: if the scene cannot be read, or lacks a body that the TOML file beside it names.
    """
    del limit_s
    if part:
        raise UserError(f"Expected the scene {path} alone, got {path}:{part}; name its bodies in {path.stem}.toml")
    return of_scene(path)
