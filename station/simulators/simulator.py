"""The interface of a simulator to the rest of the station, and the available simulators.

A simulator is a folder here with a module `session` that has one class with `repeat`: `planar`, `mujoco`, or one that
is added beside them. A recording that another simulator made stands in for one, too (`Elsewhere`).
"""

from __future__ import annotations

import importlib
import inspect
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np

from shared.errors import UserError
from shared.rig import RigConfig
from station.physics.model import Model
from station.signals.session import Signals


@runtime_checkable
class Simulator(Protocol):
    """Repeats a recorded session."""

    def repeat(
        self, recorded: Signals, model: Model, *, rig: RigConfig, rng: np.random.Generator | None = None
    ) -> Signals:
        """The signals of the same session in simulation.

        Args:
            recorded: the session: its commands are repeated as they were executed, each run from its recorded pose.
            model: friction and effects.
            rig: sizes of block, plate and picture.
            rng: draws what differs by chance (scatter, shaking); None: nothing does.

        Returns:
            The same tracks at the same times, runs that could not be repeated left as they were recorded.

        Raises:
            UserError: if the recording lacks what a simulation needs.
        """
        ...


class Elsewhere:
    """A simulation that somebody else made, as a recording of the same runs."""

    def __init__(self, simulated: Signals) -> None:
        self._simulated = simulated

    def repeat(
        self, recorded: Signals, model: Model, *, rig: RigConfig, rng: np.random.Generator | None = None
    ) -> Signals:
        """Returns that recording; model, rig and chance were its maker's.

        Raises:
            UserError: if it has no run of the recorded session.
        """
        del model, rig, rng
        if not set(self._simulated.runs) & set(recorded.runs):
            raise UserError(
                f"Expected a simulation of the recorded runs {_listed(recorded.runs)}, but the one given has the runs "
                f"{_listed(self._simulated.runs)}"
            )
        return self._simulated


def names() -> tuple[str, ...]:
    """The names of the available simulators."""
    return tuple(sorted(path.parent.name for path in Path(__file__).parent.glob("*/session.py")))


def simulator(name: str) -> Simulator:
    """The simulator of that name.

    Raises:
        UserError: if there is none.
    """
    if name not in names():
        raise UserError(f"Expected a simulator ({', '.join(names())}) or a recording made by another one, got '{name}'")
    module = importlib.import_module(f"{__package__}.{name}.session")
    classes = [
        value for value in vars(module).values() if inspect.isclass(value) and value.__module__ == module.__name__
    ]
    found = [value for value in classes if issubclass(value, Simulator)]
    if len(found) != 1:
        raise UserError(f"Expected one class with `repeat` in {module.__file__}, found {len(found)}")
    return found[0]()


def _listed(runs: tuple[int, ...]) -> str:
    return ", ".join(str(run) for run in runs[:8]) + (" …" if len(runs) > 8 else "") if runs else "(none)"
