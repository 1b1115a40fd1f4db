"""A scene of the user's own with refined settings: what changes with them is the solver's, and no physics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from shared.rig import RigConfig
from station.physics.contact import Array
from station.signals.session import Signals
from station.simulators.mujoco.bindings import mj
from station.simulators.mujoco.numerics import Tried, checked, some_tilts
from station.simulators.planar.commands import Commands
from station.simulators.scene.driven import Driver
from station.simulators.simulator import AS_IT_IS, Refinable, Simulator
from station.simulators.yours.called import Called

IMPRATIO = 100.0
"""Friction's stiffness over the normal's at which MuJoCo's creep is a hundredth (physics/effects/solver_creep.py)."""


@dataclass(frozen=True, kw_only=True)
class Change:
    """A change of a scene's settings, by MuJoCo's names."""

    text: str
    make: Callable[[Any], None]


def changes() -> tuple[Change, ...]:
    """Returns the changes to be tried, from none at all to the largest, which is the refined scene."""
    firm = f'cone="elliptic", impratio="{IMPRATIO:g}"'
    return (
        Change(text="as it is", make=lambda _: None),
        Change(text="half the time step", make=_half_step),
        Change(text='cone="elliptic"', make=_elliptic),
        Change(text=firm, make=_firm),
        Change(text=f'{firm}, noslip_iterations="3"', make=lambda option: (_firm(option), _noslip(option))[0]),
        Change(text=f"{firm}, half the time step", make=lambda option: (_firm(option), _half_step(option))[0]),
    )


def _half_step(option: Any) -> None:
    option.timestep *= 0.5


def _elliptic(option: Any) -> None:
    option.cone = mj.mjtCone.mjCONE_ELLIPTIC


def _firm(option: Any) -> None:
    _elliptic(option)
    option.impratio = max(IMPRATIO, option.impratio)


def _noslip(option: Any) -> None:
    option.noslip_iterations = max(3, option.noslip_iterations)


class SceneSimulator(Called, Refinable):
    """A scene, called for each run; its settings can be refined."""

    def __init__(self, path: Path, change: Change | None = None) -> None:
        """Reads the scene, and changes its settings.

        Raises:
            UserError: as `Scene` does.
        """
        self._path, self._driver = path, _driver(path, change)
        super().__init__(self._driver, name=str(path), tells=True)

    def numerics(self, recorded: Signals, *, rig: RigConfig) -> tuple[list[dict[str, Any]], Simulator]:
        """Tries each change of the scene's settings on some recorded tilts.

        Returns what differs, and the scene with the settings that cure it; the scene as it is if none does.
        """
        every = changes()
        tried = [_tried(change, _driver(self._path, change)) for change in every]
        pyramid = self._driver.scene.model.opt.cone == mj.mjtCone.mjCONE_PYRAMIDAL
        found = checked(some_tilts(recorded, rig=rig), tried, mu_s=self._driver.mu, pyramid=pyramid)
        named = {one["cured_by"] for one in found}
        cure = next((change for change in reversed(every) if change.text in named), None)
        return found, self if cure is None else SceneSimulator(self._path, cure)


def _driver(path: Path, change: Change | None) -> Driver:
    driver = Driver(path)
    if change is not None:
        change.make(driver.scene.model.opt)
    return driver


def _tried(change: Change, driver: Driver) -> Tried:
    def simulated(commands: Commands, times: Array) -> Array:
        rows = (commands.rows(slice(row, row + 1)) for row in range(len(commands)))
        return np.stack([driver(row, AS_IT_IS, 1.0).at(times) for row in rows])

    return Tried(text=change.text, tilted=simulated, sliding=simulated)


def of_scene(path: Path) -> SceneSimulator:
    """Returns a simulator from a MuJoCo scene.

    Raises:
        UserError: as `Scene` does.
    """
    return SceneSimulator(path)
