"""Says where recordings differ from a plain simulation, which physics that is, and how far modelling it closes the gap.

A recording (.mcap) is judged by its onsets, its slides and its marks; a table (.csv, .parquet) by its onsets or its
coefficients of friction, with whatever covariates it has (the columns of `station samples --csv`, and those of
tribometers; only onset_angle_rad, friction_coefficient or friction_force_n must be there).

Of several recordings, a glob or a folder it prints a row each. The answers are kept in the folder of --out, and those
that are there already are taken from it (station/app/many/README.md).
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import sys
from pathlib import Path

import tomli_w
from rich.console import Console

from shared.arguments import above_0, seed_of
from shared.errors import UserError
from shared.rig import load_rig
from station.app.diagnosing import TABLES, diagnose_file
from station.app.many.diagnoses import diagnosing, placed
from station.app.many.named import Chosen
from station.app.many.options import add_files, add_out, add_spreading, chosen_by, work_through
from station.app.many.remote import local
from station.app.many.shown import exit_status
from station.app.one_run import run_in_motion
from station.app.outputs import require_writable
from station.app.planned import write_plan
from station.app.plugins import named_in, plugin_folders
from station.app.progress import stages
from station.app.simulating import rig_of
from station.cluster import cluster
from station.diagnosis.diagnose import Examined
from station.diagnosis.predict.folds import named, nested
from station.diagnosis.report.summary import summary
from station.diagnosis.result import Diagnosis
from station.diagnosis.result_json import as_json
from station.pages.caption import command_line, made_by
from station.pages.figure import kept_in
from station.physics.catalogue import catalogue_of_table
from station.recording.reader import open_recording
from station.simulators.simulator import LIMIT_S

NAME = "diagnose"
HELP = "say where recording and simulation differ, which physics was left out, and how far it closes the gap"
ONE = "of many recordings, some could not be read"
OUT = Path("diagnoses")
EXAMPLE = "station diagnose sim.mcap --report page.html --overlay seen.rrd --model model.toml --json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    add_files(parser)
    add_out(parser, instead=f"of several recordings: {OUT}")
    parser.add_argument("--rig", type=Path, help="rig file; without it the one inside the recording")
    parser.add_argument("--json", action="store_true", help="print the result as JSON (a list for several files)")
    parser.add_argument("--model", type=Path, metavar="PATH", help="write what was found as model.toml")
    parser.add_argument("--report", type=Path, metavar="PATH", help="write it as one HTML page with figures")
    parser.add_argument(
        "--figures", type=Path, metavar="FOLDER", help="with --report: write its figures as SVG and PDF, too"
    )
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
        type=above_0,
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
    parser.add_argument("--seed", type=seed_of, default=1, help="seed of the null's draws and of the held-out folds")
    add_spreading(parser)


def run(options: argparse.Namespace) -> int:
    """Diagnoses the files; 0, or with many 1 if some could not be read."""
    chosen = chosen_by(options)
    if not (chosen.one and options.out is None):
        return _many(chosen, options)
    if options.figures and not options.report:
        raise UserError("Expected --report PATH together with --figures, as they are the figures of the report")
    name, file = chosen.names[0], local(chosen.names[0])
    if options.overlay and file.suffix in TABLES:
        raise UserError(f"Expected a recording (.mcap) together with --overlay, got the table {name}")
    for what in _FILES:
        if path := getattr(options, what):
            require_writable(path, what=what)
    if options.overlay:  # should the viewer's package be missing, it is said before the work is done
        importlib.import_module("station.app.overlaid")
    console = Console(stderr=True, highlight=False)
    found = _one(file, name, options, console)
    if options.json:
        print(json.dumps(as_json(found.diagnosis), indent=1))
    else:
        terminal = Console(width=None if sys.stdout.isatty() else 140, highlight=False)
        terminal.print(summary(found.diagnosis))
    with stages(console, "writing the files"):
        _write_files(found, file, options)
    if options.overlay:
        with stages(console, "simulating the recording before and after"):
            _overlay(file, found.diagnosis, options)
    return 0


def _many(chosen: Chosen, options: argparse.Namespace) -> int:
    for what in _FILES:
        if getattr(options, what):
            raise UserError(f"Expected one file together with --{what} and no --out, got {len(chosen.names)}")
    if options.rig:
        load_rig(options.rig)  # a mistake in it is said once, before the work
    asked = {name: getattr(options, name) for name in _ASKED}
    return exit_status(work_through(chosen, diagnosing(**placed(asked)), options, out=options.out or OUT))


def _write_files(found: Examined, path: Path, options: argparse.Namespace) -> None:
    answer = found.diagnosis
    if options.model:
        _write(options.model, tomli_w.dumps(dict(answer.model)), what="model")
    if options.report:
        from station.diagnosis.report.page import html_page  # noqa: PLC0415  # matplotlib is slow to load

        with made_by(_command(answer.recording, options)), kept_in(options.figures):
            motion = "" if path.suffix in TABLES else run_in_motion(path, answer, rig_path=options.rig)
            page = html_page(answer, found.pictures, seed=options.seed, motion=motion)
        _write(options.report, page, what="report")
    if options.plan:
        print(write_plan(answer.next_experiment, options.plan), file=sys.stderr)


def _command(name: str, options: argparse.Namespace) -> str:
    """Returns the command that makes this report again."""
    plugins = [word for folder in options.plugins for word in ("--plugins", folder)]
    limit_s = None if options.simulate_limit == LIMIT_S else f"{options.simulate_limit:g}"
    return command_line(
        *("station", "diagnose", name, *plugins),
        rig=options.rig,
        simulate=options.simulate,
        simulate_limit=limit_s,
        nested=options.folding is nested,
        seed=options.seed,
        report=options.report,
        figures=options.figures,
    )


def _one(file: Path, name: str, options: argparse.Namespace, console: Console) -> Examined:
    asked = {name: getattr(options, name) for name in _ASKED}
    jobs = options.jobs or os.cpu_count() or 1
    with stages(console, "reading the recording") as show, cluster(options.backend):
        return diagnose_file(file, name=name, jobs=jobs, status=show, **asked)


_ASKED = ("rig", "seed", "simulate", "simulate_limit", "plugins", "folding")
"""The options that mean the same for each of several files."""
_FILES = ("model", "report", "overlay", "plan")
"""The options that name a file for the answer of one."""


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
