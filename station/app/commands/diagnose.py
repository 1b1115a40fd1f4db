"""Says where recordings differ from a plain simulation, which physics that is, and how far modelling it closes the gap.

A recording (.mcap) is judged by its onsets, its slides and its marks; a table (.csv, .parquet) by its onsets or its
coefficients of friction, with whatever covariates it has (the columns of `station samples --csv`, and those of
tribometers; only onset_angle_rad, friction_coefficient or friction_force_n must be there).
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import tomli_w
from rich.console import Console

from shared.errors import UserError
from station.app.diagnosing import TABLES, diagnose_file
from station.app.one_run import run_in_motion
from station.app.outputs import require_writable
from station.app.planned import write_plan
from station.app.plugins import named_in, plugin_folders
from station.app.simulating import rig_of
from station.diagnosis.diagnose import Examined
from station.diagnosis.predict.folds import named, nested
from station.diagnosis.report.page import html_page
from station.diagnosis.report.summary import summary
from station.diagnosis.result import Diagnosis, as_json
from station.physics.catalogue import catalogue_of_table
from station.pool import spread
from station.recording.reader import open_recording
from station.simulators.simulator import LIMIT_S

NAME = "diagnose"
HELP = "say where recording and simulation differ, which physics was left out, and how far it closes the gap"
EXAMPLE = "station diagnose sim.mcap --report page.html --overlay seen.rrd --model model.toml --json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument(
        "files", type=Path, nargs="+", metavar="FILE", help="recordings (.mcap) or tables of samples (.csv, .parquet)"
    )
    parser.add_argument("--rig", type=Path, help="rig file; without it the one inside the recording")
    parser.add_argument("--json", action="store_true", help="print the result as JSON (a list for several files)")
    parser.add_argument("--model", type=Path, metavar="PATH", help="write what was found as model.toml")
    parser.add_argument("--report", type=Path, metavar="PATH", help="write it as one HTML page with figures")
    parser.add_argument("--plan", type=Path, metavar="PATH", help="write the next experiment for station run --plan")
    parser.add_argument(
        "--overlay",
        type=Path,
        metavar="PATH.rrd",
        help="write recording and simulations (by --simulate, or else planar), marked, for the Rerun viewer",
    )
    parser.add_argument(
        "--simulate",
        metavar="NAME",
        help="simulate the recording again, before and after: planar, mujoco, a simulation's recording (.mcap), a "
        "Python function of your own (my_sim.py or my_sim.py:function), or a MuJoCo scene of your own (scene.xml); "
        "with a table, a simulated table",
    )
    parser.add_argument(
        "--simulate-limit",
        type=float,
        default=LIMIT_S,
        metavar="SECONDS",
        help="the longest that one run in your own simulator may take, in seconds",
    )
    parser.add_argument(
        "--plugins",
        type=Path,
        action="append",
        default=[],
        metavar="FOLDER",
        help="folder with simulators of your own (FOLDER/simulators/NAME.py or .xml); may be repeated",
    )
    parser.add_argument(
        "--nested",
        dest="folding",
        action="store_const",
        const=nested,
        default=named,
        help="search each held-out fold anew, names included: several times as long",
    )
    parser.add_argument("--seed", type=int, default=1, help="of the null's draws and the held-out folds")
    parser.add_argument(
        "--jobs", type=int, default=0, help="processes, for the files or the folds of one; 0: one for each core"
    )


def run(options: argparse.Namespace) -> int:
    """Diagnoses the files; 0."""
    files: list[Path] = options.files
    for name in ("model", "report", "overlay", "plan"):
        if getattr(options, name) and len(files) > 1:
            raise UserError(f"Expected one file together with --{name}, got {len(files)}")
    if options.overlay and files[0].suffix in TABLES:
        raise UserError(f"Expected a recording (.mcap) together with --overlay, got the table {files[0]}")
    for name in ("model", "report", "overlay", "plan"):
        if path := getattr(options, name):
            require_writable(path, what=name)
    if options.overlay:  # should the viewer's package be missing, it is said before the work is done
        importlib.import_module("station.app.overlaid")
    console = Console(stderr=True, highlight=False)
    everything = _all(files, options, console)
    found = [one.diagnosis for one in everything]
    if options.json:
        answers = [as_json(diagnosis) for diagnosis in found]
        print(json.dumps(answers[0] if len(answers) == 1 else answers, indent=1))
    else:
        terminal = Console(width=None if sys.stdout.isatty() else 140, highlight=False)
        for diagnosis in found:
            terminal.print(summary(diagnosis))
    _write_files(everything[0], options)
    if options.overlay:
        with console.status("simulating the recording before and after"):
            _overlay(files[0], found[0], options)
    return 0


def _write_files(found: Examined, options: argparse.Namespace) -> None:
    answer = found.diagnosis
    if options.model:
        _write(options.model, tomli_w.dumps(dict(answer.model)), what="model")
    if options.report:
        path: Path = options.files[0]
        motion = "" if path.suffix in TABLES else run_in_motion(path, answer, rig_path=options.rig)
        page = html_page(answer, found.pictures, seed=options.seed, motion=motion)
        _write(options.report, page, what="report")
    if options.plan:
        print(write_plan(answer.next_experiment, options.plan), file=sys.stderr)


def _all(files: Sequence[Path], options: argparse.Namespace, console: Console) -> list[Examined]:
    if len(files) == 1:
        with console.status("reading the recording") as status:
            return [
                diagnose_file(
                    files[0],
                    rig=options.rig,
                    seed=options.seed,
                    simulate=options.simulate,
                    simulate_limit=options.simulate_limit,
                    plugins=options.plugins,
                    folding=options.folding,
                    jobs=options.jobs or os.cpu_count() or 1,
                    status=status.update,
                )
            ]
    asked = {name: getattr(options, name) for name in _ASKED}
    found: list[Examined] = []
    with spread(partial(diagnose_file, **asked), files, jobs=options.jobs) as made:
        for path, one in zip(files, made, strict=True):
            console.print(f"{path}: {one.diagnosis.verdict} ({one.diagnosis.seconds:.0f} s)", markup=False)
            found.append(one)
    return found


_ASKED = ("rig", "seed", "simulate", "simulate_limit", "plugins", "folding")
"""The options that mean the same for each of several files."""


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
        simulate=named_in(plugin_folders(rig.plugins, options.plugins), options.simulate or "planar"),
    )


def _write(path: Path, text: str, *, what: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise UserError(f"Expected to write the {what} to {path}, but that failed: {error.strerror}") from error
