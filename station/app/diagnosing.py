"""The diagnosis of a file, or of a session that is open: with its rig, its simulation, and what its figures need."""

from __future__ import annotations

import importlib.metadata
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from threadpoolctl import threadpool_limits

from shared import installed
from shared.config import Table
from shared.errors import UserError
from shared.messages import Sample
from shared.rig import RigConfig, load_rig
from station.app.simulated_again import refuse_unknown, simulated_again
from station.app.simulating import rig_of
from station.diagnosis.diagnose import Examined, examined
from station.diagnosis.observations.evidence import Setting
from station.diagnosis.predict.folds import Folding, named
from station.diagnosis.search.search import Progress
from station.physics.catalogue import catalogue_of_table
from station.recording.arrays import load_signals
from station.recording.reader import open_recording
from station.recording.tables import read_samples
from station.signals.session import Signals

TABLES = (".csv", ".parquet")
PACKAGES = ("numpy", "scipy", "mujoco")


def diagnose_file(
    path: Path,
    *,
    rig: Path | None = None,
    seed: int = 1,
    simulate: str | None = None,
    folding: Folding = named,
    jobs: int = 1,
    status: Progress = lambda _: None,
) -> Examined:
    """Diagnoses one file, with so many processes (`jobs`); with what its report's figures need.

    Raises:
        UserError: if it is missing, damaged or of another kind.
    """
    began = time.monotonic()
    if path.suffix in TABLES:
        config = load_rig(rig) if rig else None
        recorded = read_samples(path)
    else:
        reader = open_recording(path)
        config = rig_of(reader, path=rig)
        if simulate:
            refuse_unknown(simulate, rig=config)
        status("reading the recording")
        recorded = load_signals(reader)
    found = diagnose_session(
        recorded, name=str(path), rig=config, seed=seed, simulate=simulate, folding=folding, jobs=jobs, status=status
    )
    return replace(found, diagnosis=replace(found.diagnosis, seconds=time.monotonic() - began))


def diagnose_session(
    recorded: Signals | Sequence[Sample],
    *,
    name: str,
    rig: RigConfig | None = None,
    seed: int = 1,
    simulate: str | None = None,
    folding: Folding = named,
    jobs: int = 1,
    status: Progress = lambda _: None,
) -> Examined:
    """Diagnoses a session's signals, or the rows of a table, by that name.

    Linear algebra gets one thread: its matrices are small, and a second thread, which mostly waits for the first, took
    as much processor time again (60 runs on two busy cores, `time station diagnose --jobs 1` with and without
    OPENBLAS_NUM_THREADS=1: 10.5 s, and 17 to 23 s).

    Raises:
        UserError: if a table is to be simulated, or the simulation cannot be.
    """
    began = time.monotonic()
    if simulate:
        if rig is None or not isinstance(recorded, Signals):
            raise UserError(f"Expected a recording (.mcap) together with --simulate, got the table {name}")
        refuse_unknown(simulate, rig=rig)
    setting = setting_of(rig)
    known = catalogue_of_table(rig.physics if rig else Table({}))
    with threadpool_limits(limits=1, user_api="blas"):
        found = examined(
            recorded, known, name=name, setting=setting, seed=seed, folding=folding, jobs=jobs, progress=status
        )
    answer = found.diagnosis
    if simulate and rig is not None and isinstance(recorded, Signals):
        answer = simulated_again(found, recorded, rig=rig, setting=setting, simulate=simulate, progress=status)
    answer = replace(answer, seconds=time.monotonic() - began, versions=versions())
    return replace(found, diagnosis=answer)


def setting_of(rig: RigConfig | None) -> Setting:
    """The sizes that the evidence needs."""
    if rig is None:
        return Setting()
    return Setting(
        opening_radius_m=0.5 * rig.plate.opening_m,
        opening_outline_m=rig.plate.opening_outline_m,
        block_side_m=rig.block.size_m[0],
        block_mass_kg=rig.block.mass_kg,
    )


def versions() -> dict[str, str]:
    """The versions of the packages that the answer depends on."""
    return {"repose": installed.version()} | {package: importlib.metadata.version(package) for package in PACKAGES}
