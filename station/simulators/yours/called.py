"""A simulator of the user's own, called for each run of a recorded session."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from shared.errors import UserError
from shared.rig import RigConfig
from station.physics.contact import Array
from station.physics.model import Model
from station.signals.session import Signals
from station.simulators.planar.commands import Commands
from station.simulators.planar.session import repeated
from station.simulators.planar.simulate import Chances, Motions
from station.simulators.simulator import LIMIT_S, OwnFriction
from station.simulators.yours.answer import Answer
from station.simulators.yours.child import Child
from station.simulators.yours.found import needs_telling
from station.simulators.yours.function import NAMED, Function, called, takes_found

Caller = Callable[[Commands, Model, float], Answer]
"""Simulates one run: commands with a single row, what to change, and the run's own factor on the friction."""


class Called(OwnFriction):
    """A function of the user's that is called for each run; see README.md of this folder.

    It has a friction of its own: the model says what to change in it, and its mu_s is a factor.
    """

    def __init__(self, call: Caller, *, name: str, tells: bool) -> None:
        """Takes what calls the function, its name, and whether it can be told what was found (`tells`)."""
        self._call, self._name = call, name
        self._held = True
        """True if no run has been given anything since the session was begun."""
        self.why_not_rerun = (
            "" if tells else f"{name} could not be run with what was found: it takes no second argument"
        )

    def repeat(
        self, recorded: Signals, model: Model, *, rig: RigConfig, rng: np.random.Generator | None = None
    ) -> Signals:
        """Repeats as `Simulator.repeat` says; raises UserError also for whatever the function does wrong."""
        self._held = True
        simulated = repeated(recorded, model, rig=rig, rng=rng, simulated=self._simulate)
        self.gave = "gave None or nan (the block held) for" if self._held else ""
        return simulated

    def _simulate(self, commands: Commands, model: Model, *, time_s: ArrayLike, chances: Chances) -> Motions:
        stamps, delay_s = np.asarray(time_s, dtype=float), model.delay_s()
        answers = [
            self._run(commands.rows(slice(row, row + 1)), model, float(chances.friction[row]))
            for row in range(len(commands))
        ]
        self._held = self._held and all(answer.is_nothing for answer in answers)
        onset_s = np.array([answer.onset_s for answer in answers])
        path = np.stack([answer.at(own) for answer, own in zip(answers, stamps - delay_s, strict=True)])
        return Motions(
            onset_s=onset_s,
            onset_rad=commands.resting_tilt_at(onset_s + delay_s),
            way_rad=np.array([_way(answer) for answer in answers]),
            slip_end_s=np.full(len(commands), math.nan),
            pose=np.stack([answer.pose[-1] for answer in answers]),
            time_s=stamps,
            path=path,
        )

    def _run(self, commands: Commands, model: Model, friction: float) -> Answer:
        if self.why_not_rerun and needs_telling(model, friction):
            raise UserError(self.why_not_rerun)
        try:
            return self._call(commands, model, friction)
        except UserError as error:
            said = str(error)
            if said.startswith("Expected"):  # the process says it, and names the function
                raise
            raise UserError(f"{self._name}, run {int(commands.run[0])} of the session: {said}") from error


def of_function(function: Function, *, name: str = "") -> Called:
    """Gives a simulator from a function in this process, without a time limit: whoever passes one can interrupt it."""

    def call(commands: Commands, model: Model, friction: float) -> Answer:
        return called(function, commands, model, friction)

    return Called(call, name=name or getattr(function, "__name__", "the simulator"), tells=takes_found(function))


def of_file(path: Path, function: str = NAMED, *, limit_s: float = LIMIT_S) -> Called:
    """Returns a simulator from a function of a Python file, which runs in a process of its own.

    Raises:
        UserError: if it cannot be loaded.
    """
    child = Child(path, function or NAMED, limit_s=limit_s)
    return Called(child.run, name=f"{path}:{function or NAMED}", tells=child.takes_found)


def _way(answer: Answer) -> float:
    """Returns the direction of the first motion; nan without one that is known."""
    moved: Array = answer.pose[-1, :2] - answer.pose[0, :2]
    return math.atan2(moved[1], moved[0]) if answer.known and math.isfinite(answer.onset_s) else math.nan
