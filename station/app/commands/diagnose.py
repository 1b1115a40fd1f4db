"""Says where recordings differ from a plain simulation, which physics that is, and how far modelling it closes the gap.

A recording (.mcap) is judged by its onsets, its slides and its marks; a table of samples (.csv, .parquet) by its onsets
alone, with whatever covariates it has (the columns of `station samples --csv`; only onset_angle_rad must be there).
Exit status: 0; 2 for a mistake in what was asked.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed
from rich.console import Console

from shared.errors import UserError
from station.app.diagnosing import TABLES
from station.app.front.diagnosis import Diagnosed, diagnose
from station.app.outputs import require_writable
from station.app.simulating import rig_of
from station.diagnosis.report.summary import summary
from station.diagnosis.result import Diagnosis
from station.physics.catalogue import catalogue_of_table
from station.recording.reader import open_recording

NAME = "diagnose"
HELP = "say where recording and simulation differ, which physics was left out, and how far it closes the gap"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument(
        "files", type=Path, nargs="+", metavar="FILE", help="recordings (.mcap) or tables of samples (.csv, .parquet)"
    )
    parser.add_argument("--rig", type=Path, help="rig file; without it the one inside the recording")
    parser.add_argument("--json", action="store_true", help="print the result as JSON (a list for several files)")
    parser.add_argument("--model", type=Path, metavar="PATH", help="write what was found as model.toml")
    parser.add_argument("--report", type=Path, metavar="PATH", help="write it as one HTML page with figures")
    parser.add_argument(
        "--overlay",
        type=Path,
        metavar="PATH.rrd",
        help="write recording and simulations (by --simulate, or else planar), marked, for the Rerun viewer",
    )
    parser.add_argument(
        "--simulate",
        metavar="NAME",
        help="simulate the recording again, before and after: planar, mujoco, or a simulation's recording (.mcap)",
    )
    parser.add_argument(
        "--nested",
        action="store_true",
        help="search each held-out fold anew, names included: several times as long",
    )
    parser.add_argument("--seed", type=int, default=1, help="of the null's draws and the held-out folds")
    parser.add_argument(
        "--jobs", type=int, default=0, help="processes, for the files or the folds of one; 0: one for each core"
    )


def run(options: argparse.Namespace) -> int:
    """Diagnoses the files; 0."""
    files: list[Path] = options.files
    _refuse_impossible(files, options)
    found = _all(files, options)
    if options.json:
        answers = [answer.to_dict() for answer in found]
        print(json.dumps(answers[0] if len(answers) == 1 else answers, indent=1))
    else:
        terminal = Console(width=None if sys.stdout.isatty() else 140, highlight=False)
        for answer in found:
            terminal.print(summary(answer.diagnosis))
    if options.model:
        found[0].write_model(options.model)
    if options.report:
        found[0].write_report(options.report)
    if options.overlay:
        with _console().status("simulating the recording before and after"):
            _overlay(files[0], found[0].diagnosis, options)
    return 0


def _refuse_impossible(files: Sequence[Path], options: argparse.Namespace) -> None:
    """Refuses what cannot be written, or lacks a package, before the work is done."""
    outputs = {name: getattr(options, name) for name in ("model", "report", "overlay") if getattr(options, name)}
    for name in outputs:
        if len(files) > 1:
            raise UserError(f"Expected one file together with --{name}, got {len(files)}")
    if options.overlay and files[0].suffix in TABLES:
        raise UserError(f"Expected a recording (.mcap) together with --overlay, got the table {files[0]}")
    for name, path in outputs.items():
        require_writable(path, what=name)
    if options.overlay:
        importlib.import_module("station.app.overlaid")


def _all(files: Sequence[Path], options: argparse.Namespace) -> list[Diagnosed]:
    console, jobs = _console(), options.jobs or os.cpu_count() or 1
    asked = {name: getattr(options, name) for name in ("rig", "seed", "nested")} | {"simulation": options.simulate}
    if len(files) == 1:
        with console.status("reading the recording") as status:
            return [diagnose(files[0], jobs=jobs, progress=status.update, **asked)]
    # joblib's backend can be Dask or Ray, if the caller has set one up (joblib.parallel_config).
    work = (delayed(diagnose)(path, **asked) for path in files)
    made: Any = Parallel(n_jobs=min(jobs, len(files)), return_as="generator")(work)
    found: list[Diagnosed] = []
    for path, one in zip(files, made, strict=True):
        console.print(f"{path}: {one.verdict} ({one.diagnosis.seconds:.0f} s)", markup=False)
        found.append(one)
    return found


def _console() -> Console:
    return Console(stderr=True, highlight=False)


def _overlay(path: Path, diagnosis: Diagnosis, options: argparse.Namespace) -> None:
    from station.app.overlaid import write_overlay  # noqa: PLC0415  # only this needs the viewer's package

    reader = open_recording(path)
    rig = rig_of(reader, path=options.rig)
    known = catalogue_of_table(rig.physics)
    write_overlay(
        reader,
        diagnosis,
        options.overlay,
        rig=rig,
        known=known,
        rig_path=options.rig,
        simulate=options.simulate or "planar",
    )
