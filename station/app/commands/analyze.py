"""Analyses recordings or tables of samples: filters, results by surface pair, tests of anisotropy, figures, a report.

Every file may hold any surface pairs; what has the same object and plate is put together. Into the folder of --out go
report.html (self-contained), the figures as PNG, SVG and PDF, figures.rrd with the paper's Figs. 7 to 9 for Rerun
(--rerun opens it), samples.csv and samples.parquet with every sample and the names of the filters that flagged it, and
limit_curves.json with the fitted limit curves and distributions. Of several recordings, a glob or a folder it prints a
row each; those that cannot be read are left out (station/app/many/README.md).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from rich.console import Console

from shared.arguments import seed_of
from shared.errors import UserError
from shared.system import desktop
from station.app.analysis_files import FIGURES_RRD
from station.app.front.analysis import analyze
from station.app.many.analyses import reading, sessions_of
from station.app.many.each import Row
from station.app.many.options import add_files, add_spreading, chosen_by, work_through
from station.app.many.remote import local
from station.app.many.shown import exit_status
from station.friction.filters import CUTOUT_M
from station.view import viewer

NAME = "analyze"
HELP = "filter samples, test anisotropy, draw the paper's figures and write a report"
EXAMPLE = "station analyze sim.mcap --out report"
ONE = "something that was asked of the data cannot be concluded, or of many recordings some could not be read"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    add_files(parser)
    parser.add_argument("--out", type=Path, default=Path("analysis"), metavar="FOLDER", help="where the results go")
    parser.add_argument("--calibration", type=Path, metavar="RECORDING", help="calibration of files that have none")
    parser.add_argument("--cutout-mm", type=float, default=CUTOUT_M * 1e3, help="radius of the opening in the foam")
    parser.add_argument("--rerun", action="store_true", help="open the figures in Rerun (they are always written)")
    parser.add_argument("--seed", type=seed_of, default=1, help="seed of the permutation tests")
    add_spreading(parser)


def run(options: argparse.Namespace) -> int:
    """Analyses the files; 0 when everything could be concluded, 1 when not."""
    if not options.cutout_mm > 0:
        raise UserError(f"Expected a positive radius for --cutout-mm, got {options.cutout_mm:g}")
    chosen, rows = chosen_by(options), list[Row]()
    if not chosen.one:
        rows = work_through(chosen, reading(), options, out=options.out)
        if exit_status(rows) == 2:
            return 2
    found = analyze(
        sessions_of(rows) or [local(name) for name in chosen.names],
        calibration=options.calibration,
        cutout_m=options.cutout_mm * 1e-3,
        seed=options.seed,
    )
    console = Console(width=None if sys.stdout.isatty() else 150, highlight=False)
    for part in found.in_words():
        console.print(part)
    print("\n".join(found.write(options.out)))
    if options.rerun:
        _open(options.out / FIGURES_RRD)
    return exit_status(rows, findings=found.has_findings) if rows else int(found.has_findings)


def _open(path: Path) -> None:
    if desktop.has_display():
        viewer.open_file(path)
    else:
        print(f"There is no display here. Look elsewhere with: rerun {path}")
