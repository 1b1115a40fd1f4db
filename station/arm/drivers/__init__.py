"""Arm drivers: one file each, found by its name in this folder and imported only when it is asked for.

A driver file defines `connect(link: DriverLink) -> Driver`. Nothing reaches a driver that has not passed the safety
gate; a driver in turn keeps no time and no thread that moves the arm: `tick` drives it.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol, cast

import numpy as np
from numpy.typing import NDArray

from shared.bus import Bus
from shared.config import Table
from shared.errors import UserError
from shared.frozen import quicken
from station.arm.trajectory import JointTrajectory
from station.rig.arm_model import ArmModel

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class JointReading:
    """The joints' readings at `stamp_ns`: names, and position, velocity and effort, (n,) each.

    Nobody writes to the arrays again: where they are those of the reading before, nothing has changed.
    """

    stamp_ns: int
    names: tuple[str, ...]
    position_rad: Array
    velocity_rad_s: Array
    effort_nm: Array


quicken(JointReading)


@dataclass(frozen=True, kw_only=True)
class DriverLink:
    """The resources of a driver: the bus, the arm's model, and its own table of rig.toml.

    A driver that brakes may use `acceleration_share` of the model's accelerations, as the gate lets motions do.
    """

    bus: Bus
    model: ArmModel
    options: Table = field(default_factory=lambda: Table({}))
    acceleration_share: float = 1.0


class Driver(Protocol):
    """One kind of arm. Times are nanoseconds of the agent's clock; a call never blocks longer than a tick."""

    def start(self, trajectory: JointTrajectory, *, now_ns: int) -> None:
        """Begins a motion now; it replaces a motion under way."""
        ...

    def halt(self, *, now_ns: int) -> None:
        """Stops at once and holds; it is allowed at any time, also when nothing moves."""
        ...

    def tick(self, now_ns: int) -> None:
        """Does what is due: sends the next set-point, takes in what has arrived."""
        ...

    def read(self) -> JointReading | None:
        """Returns the latest reading in the model's joint order; None before the first."""
        ...

    def fault(self) -> str:
        """Returns one sentence when the arm does not do its part (no answer, goal rejected), else an empty text."""
        ...

    def close(self) -> None:
        """Releases the arm, which holds where it is."""
        ...


class _DriverModule(Protocol):
    def connect(self, link: DriverLink) -> Driver:
        """Opens the driver."""
        ...


def driver_names() -> tuple[str, ...]:
    """Returns the names of all drivers in this folder."""
    return tuple(sorted(path.stem for path in Path(__file__).parent.glob("*.py") if not path.stem.startswith("_")))


def load_driver(name: str, *, link: DriverLink) -> Driver:
    """Imports the driver `name` and connects it.

    Raises UserError when there is no such driver, or with the driver's own sentence when it cannot connect.
    """
    if name not in driver_names():
        raise UserError(f"Expected an arm driver in rig.toml, one of {', '.join(driver_names())}; got {name!r}.")
    module = cast(_DriverModule, importlib.import_module(f"{__name__}.{name}"))
    return module.connect(link)


def match_joints(model: ArmModel, names: tuple[str, ...]) -> list[int]:
    """Gives the place of each joint of the model among the names that an arm reports; fingers and others are left out.

    Raises UserError when one is missing.
    """
    missing = [name for name in model.joint_names if name not in names]
    if missing:
        raise UserError(
            f"The arm reports the joints {', '.join(names) or '(none)'}, but the model {model.name} needs "
            f"{', '.join(missing)}: correct the model in rig.toml, or the joint names in the model's file."
        )
    return [names.index(name) for name in model.joint_names]
