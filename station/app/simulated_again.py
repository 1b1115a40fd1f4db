"""The user's simulator beside the diagnosis: what its numerics do, and how it fares before and after what was found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from shared.errors import UserError
from shared.rig import RigConfig
from station.app.simulations import Simulation
from station.diagnosis.diagnose import Examined, Source, read
from station.diagnosis.given import against_given
from station.diagnosis.observations.setting import Setting
from station.diagnosis.predict.simulated import parts_of_plain
from station.diagnosis.result import Diagnosis
from station.friction.onset import estimate_onset
from station.physics.catalogue import catalogue_of_table
from station.physics.model import Model
from station.signals.session import Signals
from station.simulators.artefacts import artefacts
from station.simulators.mujoco.numerics import BASELINE, numerics
from station.simulators.mujoco.own_settings import own_setup
from station.simulators.rerun import RUNS, Part, rerun_in_parts, some_runs
from station.simulators.same_runs import refuse_other_runs
from station.simulators.simulator import AS_IT_IS, OwnFriction, RecordedSimulation, Refinable
from station.simulators.yours.called import Called

Progress = Callable[[str], None]


def tried(recorded: Source, simulation: Simulation, *, rig: RigConfig, progress: Progress = lambda _: None) -> None:
    """Asks a given simulation for a run as it is: what is wrong with it is told before the recording is diagnosed.

    A simulator of ours and a scene are not asked: opening them shows what is wrong with them. What a recording lacks
    that cannot be simulated is said by its diagnosis.

    Raises:
        UserError: if the simulation is one of other commands, or whatever a function does wrong in its first run.
    """
    if not isinstance(simulation.engine, Called | RecordedSimulation):
        return
    signals = read(recorded)
    if not isinstance(signals, Signals):
        return
    try:
        one = some_runs(signals, 1)
    except UserError:
        return
    progress(f"trying {simulation.name}")
    if isinstance(simulation.engine, RecordedSimulation):
        refuse_other_runs(signals, simulation.engine.repeat(signals, AS_IT_IS, rig=rig), name=simulation.name)
    else:
        simulation.engine.repeat(one, AS_IT_IS, rig=rig)


def simulated_again(
    examined: Examined,
    recorded: Signals,
    *,
    rig: RigConfig,
    setting: Setting,
    simulation: Simulation,
    seed: int = 1,
    progress: Progress = lambda _: None,
) -> Diagnosis:
    """Returns the diagnosis with `simulator_rerun` and `numerics` filled in, and against the simulation that was given.

    One of our own simulators has no friction of its own: it is tried with the plain model and with what was found. A
    simulation of the user's is the baseline, and where it can be called it is tried as it is and with what was found.

    Raises:
        UserError: if the simulation is one of other commands, or whatever its maker's function does wrong.
    """
    if examined.diagnosis.verdict == "untestable" or examined.found is None:
        return examined.diagnosis
    if isinstance(simulation.engine, OwnFriction):
        return _against_the_users(
            examined, recorded, rig=rig, setting=setting, simulation=simulation, seed=seed, progress=progress
        )
    answer, found = examined.diagnosis, list[dict[str, Any]]()
    if simulation.name == "mujoco":
        progress("checking what MuJoCo's own settings do")
        found = numerics(recorded, rig=rig, mu_s=answer.mu_s.value, baseline=own_setup(rig) or BASELINE)
    diagnosis = _rerun(
        answer, recorded, parts_of_plain(examined.found), rig=rig, simulation=simulation, progress=progress
    )
    return replace(diagnosis, simulator=simulation.name, numerics=tuple(found))


def _against_the_users(
    examined: Examined,
    recorded: Signals,
    *,
    rig: RigConfig,
    setting: Setting,
    simulation: Simulation,
    seed: int,
    progress: Progress,
) -> Diagnosis:
    found = list[dict[str, Any]]()
    if isinstance(simulation.engine, Refinable):
        progress(f"checking what the settings of {simulation.name} do")
        found, cured = simulation.engine.numerics(recorded, rig=rig)
        if cured is not simulation.engine:  # a difference that changes with its settings is no physics
            simulation = replace(simulation, engine=cured, name=f"{simulation.name}, cured")
    progress(f"simulating the recorded commands with {simulation.name}")
    simulated = simulation.engine.repeat(recorded, AS_IT_IS, rig=rig)
    gave = simulation.engine.gave if isinstance(simulation.engine, OwnFriction) else ""
    refuse_other_runs(recorded, simulated, name=simulation.name)
    known = catalogue_of_table(rig.physics)

    def again(friction: float) -> Signals:
        return simulation.engine.repeat(recorded, Model(mu_s=friction), rig=rig)

    engine = simulation.engine
    takes_found = not (isinstance(engine, OwnFriction) and engine.why_not_rerun)
    given = against_given(
        examined, simulated, known, setting=setting, name=simulation.name, again=again if takes_found else None,
        camera=not isinstance(engine, OwnFriction) or engine.has_camera, gave=gave, seed=seed, progress=progress,
    )  # fmt: skip
    diagnosis = _rerun(given.diagnosis, recorded, given.parts, rig=rig, simulation=simulation, progress=progress)
    for more in (artefacts(simulated, mu_s=given.mu_s), diagnosis.numerics):  # the others show it less plainly
        known_of = {one["id"] for one in found}
        found += [dict(one) for one in more if one["id"] not in known_of]
    return replace(diagnosis, numerics=tuple(found))


def _rerun(
    answer: Diagnosis,
    recorded: Signals,
    parts: tuple[Part, ...],
    *,
    rig: RigConfig,
    simulation: Simulation,
    progress: Progress,
) -> Diagnosis:
    """Returns the diagnosis with the simulator's errors before and after, in runs of which it was told nothing."""
    most = RUNS
    if isinstance(simulation.engine, RecordedSimulation):  # it is read and not run: all its runs at once
        most, parts = len(recorded.runs), (Part(runs=frozenset(recorded.runs), before=AS_IT_IS, after=AS_IT_IS),)
    again = rerun_in_parts(
        recorded,
        parts,
        rig=rig,
        engine=simulation.engine,
        name=simulation.name,
        runs=most,
        progress=progress,
        reading=estimate_onset,
    )
    return replace(answer, fit=replace(answer.fit, simulator_rerun=again.table()))
