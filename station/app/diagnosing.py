"""The diagnosis of a file, or of a session that is open: with its rig, its simulation, and what its figures need."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from threadpoolctl import threadpool_limits

from shared.config import Table
from shared.errors import UserError
from shared.rig import RigConfig, load_rig
from station.app.attached import planted_in
from station.app.planned import NO_PLAN, RecordedPlan, upon
from station.app.setting import setting_of
from station.app.simulated_again import simulated_again, tried
from station.app.simulating import rig_of
from station.app.simulations import Given, Simulation, simulation_of
from station.app.table_simulated import SimulatedTable, against_table, table_of
from station.app.versions import versions
from station.diagnosis.diagnose import Examined, Source, examined, read
from station.diagnosis.next_experiment.recommended import recommended
from station.diagnosis.predict.folds import Folding, named
from station.diagnosis.search.search import Progress
from station.physics.catalogue import catalogue_of_table
from station.recording.arrays import load_signals
from station.recording.measured import read_measured
from station.recording.reader import open_recording
from station.signals.session import Signals
from station.simulators.simulator import LIMIT_S

TABLES = (".csv", ".parquet")


def diagnose_file(
    path: Path,
    *,
    name: str = "",
    rig: Path | None = None,
    seed: int = 1,
    simulate: Given | None = None,
    simulate_limit: float = LIMIT_S,
    plugins: Sequence[Path] = (),
    folding: Folding = named,
    jobs: int = 1,
    status: Progress = lambda _: None,
) -> Examined:
    """Diagnoses one file, with so many processes (`jobs`); with what its report's figures need.

    `name` is what the recording is called, where that is not its path.

    `simulate` is a simulator's name, a file or a function of the user's own (see `simulations.Given`), with a table the
    path of a simulated table; `simulate_limit` is the longest that one run in a user's file may take, s. `plugins` are
    folders with simulators of the user's own.

    Raises:
        UserError: if it is missing, damaged or of another kind.
    """
    began = time.monotonic()
    if path.suffix in TABLES:
        config, plan = load_rig(rig) if rig else None, NO_PLAN
        simulation = None if simulate is None else table_of(simulate)
        recorded: Source = read_measured(path)
    else:
        reader = open_recording(path)
        config = rig_of(reader, path=rig)
        simulation = None
        if simulate is not None:
            simulation = simulation_of(simulate, rig=config, limit_s=simulate_limit, plugins=plugins)
        status("reading the recording")
        recorded, plan = partial(load_signals, reader), RecordedPlan.of(reader)
    found = diagnose_session(
        recorded, name=name or str(path), rig=config, plan=plan, seed=seed, simulate=simulation, folding=folding,
        jobs=jobs, status=status,
    )  # fmt: skip
    return replace(found, diagnosis=replace(found.diagnosis, seconds=time.monotonic() - began))


def diagnose_session(
    recorded: Source,
    *,
    name: str,
    rig: RigConfig | None = None,
    plan: RecordedPlan = NO_PLAN,
    seed: int = 1,
    simulate: Given | Simulation | SimulatedTable | None = None,
    folding: Folding = named,
    jobs: int = 1,
    status: Progress = lambda _: None,
) -> Examined:
    """Diagnoses a session's signals, or the rows of a table, by that name; the arguments are those of `diagnose_file`.

    Signals are large beside the evidence: a function that reads them, again for a simulation, lets them go meanwhile.

    `plan` is the session's own, upon which the next experiment is written.

    Linear algebra gets one thread: its matrices are small, and a second thread, which mostly waits for the first, took
    as much processor time again (60 runs on two busy cores, `time station diagnose --jobs 1` with and without
    OPENBLAS_NUM_THREADS=1: 10.5 s, and 17 to 23 s).

    Raises:
        UserError: if there is no rig to simulate with, or the simulation is not of these runs.
    """
    began = time.monotonic()
    with threadpool_limits(limits=1, user_api="blas"):
        found = _diagnosed(
            recorded, name=name, rig=rig, plan=plan, seed=seed, simulate=simulate, folding=folding, jobs=jobs,
            status=status,
        )  # fmt: skip
    answer = found.diagnosis
    notes = (*answer.notes, *planted_in(rig))
    answer = replace(answer, notes=notes, seconds=time.monotonic() - began, versions=versions())
    return replace(found, diagnosis=answer)


def _diagnosed(
    recorded: Source,
    *,
    name: str,
    rig: RigConfig | None,
    plan: RecordedPlan,
    seed: int,
    simulate: Given | Simulation | SimulatedTable | None,
    folding: Folding,
    jobs: int,
    status: Progress,
) -> Examined:
    """Returns the answer with the next experiment, and against the simulation if one is given."""
    setting = setting_of(rig)
    simulation: Simulation | SimulatedTable | None = None
    if isinstance(simulate, SimulatedTable):
        simulation = simulate
    elif simulate is not None:
        if rig is None:
            raise UserError(f"Expected a rig to simulate {name} with, got none; give one with --rig")
        simulation = simulation_of(simulate, rig=rig)
        tried(recorded, simulation, rig=rig, progress=status)
    known = catalogue_of_table(rig.physics if rig else Table({}))
    found = examined(
        recorded, known, name=name, setting=setting, seed=seed, folding=folding, jobs=jobs, progress=status
    )
    status("planning the next experiment")
    found = recommended(found, known)
    answer = found.diagnosis
    if answer.next_experiment is not None:
        answer = replace(answer, next_experiment=upon(plan, answer.next_experiment))
    if isinstance(simulation, SimulatedTable):
        answer = against_table(found, known, setting=setting, simulated=simulation, progress=status)
    elif simulation is not None and rig is not None and isinstance(signals := read(recorded), Signals):
        answer = simulated_again(
            found, signals, rig=rig, setting=setting, simulation=simulation, seed=seed, progress=status
        )
    return replace(found, diagnosis=answer)
