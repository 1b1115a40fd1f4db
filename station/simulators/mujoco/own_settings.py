"""The user's own MuJoCo: the table `[simulator.mujoco]` of a rig file, in MuJoCo's words."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from shared.config import Table, parse
from shared.rig import RigConfig
from station.simulators.mujoco.contact import MUJOCO_DEFAULT
from station.simulators.mujoco.tilted import Setup, Solver


@dataclass(frozen=True, kw_only=True)
class MujocoSettings:
    """The user's settings; one that is left out is MuJoCo's default, and the block is then a box on a plane."""

    timestep_s: float = 0.002
    cone: Literal["pyramidal", "elliptic"] = "pyramidal"
    impratio: float = MUJOCO_DEFAULT.impratio
    solver: Solver = "Newton"
    iterations: int = 100
    tolerance: float = MUJOCO_DEFAULT.tolerance
    noslip_iterations: int = 0
    solref: tuple[float, float] = MUJOCO_DEFAULT.solref
    solimp: tuple[float, float, float, float, float] = MUJOCO_DEFAULT.solimp

    def __post_init__(self) -> None:
        """Refuses, by a ValueError, numbers that no simulation can have."""
        for name in ("timestep_s", "impratio", "tolerance"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"expected {name} as a positive number, got {value}")
        if self.iterations < 1 or self.noslip_iterations < 0:
            raise ValueError(
                f"expected at least one iteration and no negative noslip_iterations, got {self.iterations} and "
                f"{self.noslip_iterations}"
            )

    def setup(self) -> Setup:
        """Returns the settings as the simulator takes them."""
        contact = replace(
            MUJOCO_DEFAULT,
            elliptic=self.cone == "elliptic",
            impratio=self.impratio,
            tolerance=self.tolerance,
            solref=self.solref,
            solimp=self.solimp,
        )
        return Setup(
            contact=contact,
            step_s=self.timestep_s,
            noslip=self.noslip_iterations,
            solver=self.solver,
            iterations=self.iterations,
            solid=True,
        )


def setup_of_table(table: Table) -> Setup:
    """Returns the settings in a `[simulator.mujoco]` table.

    Raises:
        UserError: naming file, line and key of what is wrong.
    """
    return parse(MujocoSettings, table).setup()


def own_setup(rig: RigConfig) -> Setup | None:
    """Returns the settings of a rig file; None if it has no table `[simulator.mujoco]`.

    Raises:
        UserError: for a setting that is unknown or cannot be, or a table of another simulator.
    """
    for name in rig.simulator.values:
        if name != "mujoco":
            raise rig.simulator.error(name, "mujoco, the one simulator with settings,", "another name")
    return setup_of_table(rig.simulator.child("mujoco")) if rig.simulator.values else None
