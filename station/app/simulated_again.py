"""The user's simulator beside the diagnosis: what its numerics do, and how it fares before and after what was found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from shared.errors import UserError
from shared.rig import RigConfig
from station.diagnosis.diagnose import Examined
from station.diagnosis.given import against_given
from station.diagnosis.observations.evidence import Setting
from station.diagnosis.result import Diagnosis
from station.physics.catalogue import catalogue_of_table
from station.physics.model import Model, model_of_table
from station.recording.arrays import load_signals
from station.recording.reader import open_recording
from station.signals.session import Signals
from station.simulators.artefacts import artefacts
from station.simulators.mujoco.numerics import BASELINE, numerics
from station.simulators.mujoco.own_settings import own_setup
from station.simulators.rerun import Errors, errors, rerun
from station.simulators.simulator import names

Progress = Callable[[str], None]


def simulated_again(
    examined: Examined, recorded: Signals, *, rig: RigConfig, setting: Setting, simulate: str, progress: Progress
) -> Diagnosis:
    """The diagnosis with `simulator_rerun` and `numerics` filled in, and against the simulation that was given.

    `simulate` is the name of a simulator, or the path of a simulation's recording (.mcap).

    Raises:
        UserError: for another name, or a file that cannot be read.
    """
    refuse_unknown(simulate, rig=rig)
    diagnosis = examined.diagnosis
    if diagnosis.verdict == "untestable":
        return diagnosis
    mu_s = diagnosis.mu_s.value
    if simulate.endswith(".mcap"):
        simulated = load_signals(open_recording(Path(simulate)))
        known = catalogue_of_table(rig.physics)
        answer = against_given(examined, simulated, known, setting=setting, name=simulate, progress=progress)
        return _elsewhere(answer, recorded, simulated, mu_s=mu_s)
    found: list[dict[str, Any]] = []
    if simulate == "mujoco":
        progress("checking what MuJoCo's own settings do")
        found = numerics(recorded, rig=rig, mu_s=mu_s, baseline=own_setup(rig) or BASELINE)
    progress(f"simulating with {simulate}, before and after")
    before = Model(mu_s=mu_s, scatter=diagnosis.scatter)
    after = model_of_table(diagnosis.model, catalogue_of_table(rig.physics))
    table = rerun(recorded, before, after, rig=rig, engine=simulate).table()
    fit = replace(diagnosis.fit, simulator_rerun=table)
    return replace(diagnosis, simulator=simulate, fit=fit, numerics=tuple(found))


def refuse_unknown(simulate: object, *, rig: RigConfig) -> None:
    """Refuses, before anything is computed, what `simulated_again` cannot simulate with.

    Raises:
        UserError: for an unknown simulator, a recording that cannot be opened, or settings of it that cannot be.
    """
    if isinstance(simulate, str) and simulate.endswith(".mcap"):
        open_recording(Path(simulate))
    elif simulate not in names():
        raise UserError(
            f"Expected {', '.join(names())} or a simulation's recording (.mcap) to simulate with, got {simulate}"
        )
    own_setup(rig)


def _elsewhere(diagnosis: Diagnosis, recorded: Signals, simulated: Signals, *, mu_s: float) -> Diagnosis:
    """Adds the errors of a recording that another simulator made: there is a before, and no after."""
    before: Errors = errors(recorded, simulated)
    table = {"engine": diagnosis.simulator, "before": before.summary(), "after": {}}
    fit = replace(diagnosis.fit, simulator_rerun=table)
    return replace(diagnosis, fit=fit, numerics=tuple(artefacts(simulated, mu_s=mu_s)))
