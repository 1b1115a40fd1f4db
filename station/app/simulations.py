"""Opens what can stand after `--simulate`, or be passed as a simulation: a name, a user's file, a function."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shared.arguments import nearest
from shared.errors import UserError
from shared.rig import RigConfig
from station.app.plugins import named_in, plugin_folders
from station.recording.arrays import load_signals
from station.recording.reader import open_recording
from station.signals.session import Signals
from station.simulators.mujoco.own_settings import own_setup
from station.simulators.simulator import LIMIT_S, RecordedSimulation, Simulator, file_of, names, opened, suffixes
from station.simulators.yours.called import of_function

Given = str | Path | Signals | Simulator | Callable[..., Any]
"""A simulator's name, ours or a file's in the user's folders; a file (a recording .mcap, my_sim.py[:function],
scene.xml); the signals of a recorded simulation; a simulator; or a function as `station/simulators/yours/README.md`
says."""


@dataclass(frozen=True, kw_only=True)
class Simulation:
    """A simulator with the name that results call it by."""

    name: str
    engine: Simulator


def simulation_of(
    given: Given | Simulation, *, rig: RigConfig, limit_s: float = LIMIT_S, plugins: Sequence[Path] = ()
) -> Simulation:
    """Opens a simulation, before anything is computed.

    Args:
        given: what the user gave.
        rig: the recording's rig, whose table [simulator.mujoco] must be right.
        limit_s: the longest that one run of a user's file may take, s.
        plugins: folders with simulators of the user's own, beside those of the rig file.

    Raises:
        UserError: for an unknown name, a file that cannot be opened, settings that cannot be, or something else.
    """
    own_setup(rig)
    if isinstance(given, Simulation):
        return given
    if isinstance(given, str | Path):
        file = named_in(plugin_folders(rig.plugins, plugins), str(given))
        return Simulation(name=str(given), engine=_of_name(file, limit_s))
    if isinstance(given, Signals):
        return Simulation(name="the given simulation", engine=RecordedSimulation(given))
    if isinstance(given, Simulator):
        return Simulation(name=type(given).__name__, engine=given)
    if not callable(given):
        raise UserError(
            "Expected a simulator's name, a file, a recording or a function to simulate with, got "
            f"{type(given).__name__}"
        )
    name = str(getattr(given, "__name__", "the given simulation"))
    return Simulation(name=name, engine=of_function(given, name=name))


def _of_name(name: str, limit_s: float) -> Simulator:
    if name.endswith(".mcap"):
        return RecordedSimulation(load_signals(open_recording(Path(name))))
    if name not in names() and file_of(name) is None:
        files = ", ".join(f"*{suffix}" for suffix in suffixes())
        raise UserError(
            f"Expected {', '.join(names())}, a simulation's recording (.mcap) or a simulator of your own ({files}) "
            f"to simulate with, got {name}{nearest(name, names())}"
        )
    return opened(name, limit_s=limit_s)
