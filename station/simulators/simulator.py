"""The interface of a simulator to the rest of the station, and the available simulators.

A simulator is a folder here with a module `session` that has one class with `repeat`: `planar`, `mujoco`, or one that
is added beside them. Files of a user's own are simulators by the module of `of_file` that has their suffix's name. A
recording that another simulator made stands in for one, too (`RecordedSimulation`).
"""

from __future__ import annotations

import importlib
import inspect
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

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
        """Returns the signals of the same session in simulation.

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


class OwnFriction:
    """A simulator that has a friction of its own: its model says what to change in it, and mu_s is a factor.

    `AS_IT_IS` leaves it as it is. `why_not_rerun` is the reason, in one sentence, why it cannot be run with the
    friction and pushes that were found; empty: it can. `has_camera` is False if it gives paths, which the tool itself
    turns into what the camera would see. `gave` says what it gave for every run when it last repeated a session, where
    that may be why its blocks hold; empty: it gave paths or onsets.
    """

    why_not_rerun: str = ""
    has_camera: bool = False
    gave: str = ""


class Refinable(OwnFriction):
    """A simulator with a friction of its own whose numerical settings can be refined."""

    def numerics(self, recorded: Signals, *, rig: RigConfig) -> tuple[list[dict[str, Any]], Simulator]:
        """Gives the effects of the settings on recorded tilts, and the simulator with those that cure it (else itself).

        Each thing is a dict of id, meant, size, unit, cured_by, before and after.

        Raises:
            UserError: if the recording lacks what a simulation needs.
        """
        raise NotImplementedError


AS_IT_IS = Model(mu_s=1.0)
"""The correction that a simulator with a friction of its own gets before anything is found: none."""


class RecordedSimulation(OwnFriction):
    """A simulation that somebody else made, as a recording of the same runs."""

    why_not_rerun = (
        "A recorded simulation could not be run with what was found; give the simulator itself to --simulate"
    )
    has_camera = True

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


LIMIT_S = 60.0
"""The longest that a run of a user's simulator takes unless it is given more (s): a MuJoCo scene at a step of 0.1 ms
takes some 20 s for a run of 10 s. `--simulate-limit` changes it."""


def suffixes() -> tuple[str, ...]:
    """Returns the suffixes of the files that are simulators."""
    modules = (Path(__file__).parent / "of_file").glob("[a-z]*.py")
    return tuple(sorted(f".{path.stem}" for path in modules))


def file_of(name: str) -> tuple[Path, str] | None:
    """Gives the file that a name means, and the part of it after a colon; None if it is no file that is a simulator."""
    path, _, part = name.rpartition(":") if Path(name).suffix not in suffixes() else (name, "", "")
    return (Path(path), part) if Path(path).suffix in suffixes() else None


def opened(name: str, *, limit_s: float = LIMIT_S) -> Simulator:
    """Returns the simulator that a name, or a user's own file with or without a part (`my_sim.py:function`), means.

    Raises:
        UserError: if there is none, or its file cannot be loaded.
    """
    file = file_of(name)
    if file is None:
        return simulator(name)
    module = importlib.import_module(f"{__package__}.of_file.{file[0].suffix[1:]}")
    return module.opened(*file, limit_s=limit_s)


def names() -> tuple[str, ...]:
    """Returns the names of the available simulators."""
    return tuple(sorted(path.parent.name for path in Path(__file__).parent.glob("*/session.py")))


def simulator(name: str) -> Simulator:
    """Returns the simulator of that name.

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
