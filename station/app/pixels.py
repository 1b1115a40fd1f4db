"""Finds the camera agent's simulated-time camera without knowing its code: by the package's entry points."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points

from shared.bus import Bus
from shared.errors import UserError
from shared.rig import RigConfig
from station.app.lockstep import LockstepCamera

GROUP = "repose.lockstep_camera"


def pixel_camera(seed: int) -> Callable[[Bus, RigConfig], LockstepCamera]:
    """A builder of the camera that renders and tracks frames in simulated time.

    Raises:
        UserError: if the camera agent is not installed here.
    """
    found = entry_points(group=GROUP, name="synthetic")
    if not found:
        raise UserError(
            f"Expected the camera agent installed beside the station for --pixels (entry point {GROUP}: synthetic); "
            "install the whole `repose` package, or leave --pixels out"
        )
    build = next(iter(found)).load()
    return lambda bus, rig: build(bus, rig, seed=seed)
