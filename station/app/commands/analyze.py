"""Analyses recordings or tables of samples: filters, results by surface pair, tests of anisotropy, figures, a report.

Every file may hold any surface pairs; what has the same object and plate is put together. Into the folder of --out go
report.html (self-contained), the figures as PNG and PDF, figures.rrd with the paper's Figs. 7 to 9 for Rerun (--rerun
opens it), samples.csv and samples.parquet with every sample and the names of the filters that flagged it, and
limit_curves.json with the fitted limit curves and distributions. Exit status: 0; 1 when something asked of the data
cannot be concluded (a sentence says what and why); 2 for a mistake in what was asked.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from shared import installed
from shared.errors import UserError
from shared.messages import Sample
from shared.system import desktop
from station.app.sessions import geometry_of, read_sessions, require_different
from station.friction.conclusions import conclusions
from station.friction.drawing import render
from station.friction.figures import figure_kinds
from station.friction.filters import CUTOUT_M, FILTERS, Opening
from station.friction.pairs import Pair, Session, pairs_of
from station.friction.report import Picture, html_report
from station.friction.report_tables import ReportTable, tables
from station.friction.results import PairResult, analyse, limit_curve_table, with_limit_curves
from station.recording.tables import write_samples
from station.view import viewer

NAME = "analyze"
FIGURES_RRD = "figures.rrd"
HELP = "filter samples, test anisotropy, draw the paper's figures and write a report"
EXAMPLE = "station analyze sim.mcap --out report"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument(
        "files", type=Path, nargs="+", metavar="FILE", help="recordings (.mcap) or tables (.csv, .parquet)"
    )
    parser.add_argument("--out", type=Path, default=Path("analysis"), metavar="FOLDER", help="where the results go")
    parser.add_argument("--calibration", type=Path, metavar="RECORDING", help="calibration of files that have none")
    parser.add_argument("--cutout-mm", type=float, default=CUTOUT_M * 1e3, help="radius of the opening in the foam")
    parser.add_argument("--rerun", action="store_true", help="open the figures in Rerun (they are always written)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the permutation tests")


def run(options: argparse.Namespace) -> int:
    """Analyses the files; 0 when everything could be concluded, 1 when not."""
    if not options.cutout_mm > 0:
        raise UserError(f"Expected a positive radius for --cutout-mm, got {options.cutout_mm:g}")
    spare = geometry_of(options.calibration) if options.calibration else None
    if options.calibration and spare is None:
        raise UserError(
            f"Expected a recording with a calibration for --calibration, but {options.calibration} has none"
        )
    sessions = read_sessions(options.files, spare=spare)
    if not any(session.samples for session in sessions):
        raise UserError(f"Expected samples in {_listed(options.files)}, but there is none: no run came to its end")
    require_different(sessions)
    pairs = pairs_of(sessions, opening=Opening(radius_m=options.cutout_mm * 1e-3))
    rng = np.random.default_rng(options.seed)
    results = with_limit_curves(analyse(pairs, rng=rng), rng=rng)
    findings = present(results, sessions)
    write_results(results, options.out, sources=[session.source for session in sessions])
    if options.rerun:
        _open(options.out / FIGURES_RRD)
    return 1 if findings else 0


# --- reading ----------------------------------------------------------------------------------------------------------


def _listed(paths: Sequence[Path]) -> str:
    return ", ".join(str(path) for path in paths)


# --- printing ---------------------------------------------------------------------------------------------------------


def present(results: Sequence[PairResult], sessions: Sequence[Session]) -> bool:
    """Prints tables and conclusions; gives whether there are findings."""
    console = Console(width=None if sys.stdout.isatty() else 150, highlight=False)
    for session in sessions:
        if not session.samples:
            console.print(f"{session.source} holds no samples: no run of that session came to its end.", markup=False)
    for table in tables(results):
        console.print(printed(table))
    findings = False
    for result in results:
        console.print(f"\n[bold]{_plain(result.pair.name)}[/]")
        for note in conclusions(result):
            console.print(f"{'!' if note.finding else '-'} {_plain(note.text)}")
            findings |= note.finding
    return findings


def _plain(text: str) -> str:
    return text.replace("[", r"\[")


def printed(table: ReportTable) -> Table:
    """A table for the terminal."""
    drawn = Table(title=table.title, title_justify="left", caption=table.note or None, caption_justify="left")
    for index, column in enumerate(table.columns):
        drawn.add_column(column, justify="right" if index else "left")
    for row in table.rows:
        drawn.add_row(*(_plain(cell) for cell in row))
    return drawn


# --- writing ----------------------------------------------------------------------------------------------------------


def write_results(
    results: Sequence[PairResult], folder: Path, *, sources: Sequence[str], first: Sequence[ReportTable] = ()
) -> None:
    """Writes report, figures, samples and limit curves; the tables `first` stand before the analysis's own."""
    figures = folder / "figures"
    try:
        figures.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"Expected to write to the folder {folder}, but that failed: {error.strerror}") from error
    pictures = {result.pair.name: _draw(result.pair, figures) for result in results}
    samples = [sample for result in results for sample in _flagged(result.pair)]
    write_samples(samples, folder / "samples.csv")
    parquet = _if_installed(lambda: write_samples(samples, folder / "samples.parquet"))
    page = html_report(results, sources=sources, pictures=pictures, first=first)
    _put(folder / "report.html", page)
    _put(folder / "limit_curves.json", json.dumps(limit_curve_table(results), indent=1, allow_nan=False))
    rrd = _if_installed(lambda: _write_rrd(results, folder / FIGURES_RRD, first=first))
    in_rerun = f", in Rerun: rerun {folder / FIGURES_RRD}" if rrd else ""
    print(f"\nReport: {folder / 'report.html'}\nFigures: {figures}{in_rerun}")
    print(f"Samples: {folder / 'samples.csv'}{', .parquet' if parquet else ''}")
    print(f"Limit curves: {folder / 'limit_curves.json'}")


def _write_rrd(results: Sequence[PairResult], path: Path, *, first: Sequence[ReportTable]) -> None:
    from station.view.analysis.rrd import write_analysis  # noqa: PLC0415  # a station without a viewer lacks its package

    write_analysis(results, path, first=first)


def _if_installed(write: Callable[[], None]) -> bool:
    """Writes a file that needs an extra; without that it is left out, and said. True if it was written."""
    try:
        write()
    except ModuleNotFoundError as missing:
        print(f"A file is left out. {installed.sentence_of(missing) or missing}")
        return False
    return True


def _open(path: Path) -> None:
    if desktop.has_display():
        viewer.open_file(path)
    else:
        print(f"There is no display here. Look elsewhere with: rerun {path}")


def _put(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise UserError(f"Expected to write {path}, but that failed: {error.strerror}") from error


def _draw(pair: Pair, folder: Path) -> list[Picture]:
    stem = re.sub(r"\W+", "-", pair.name).strip("-")
    return [
        Picture(kind, render(kind.draw, pair, folder=folder, stem=f"{stem}_{kind.name}")) for kind in figure_kinds()
    ]


def _flagged(pair: Pair) -> list[Sample]:
    """The samples with the filters' names; what the session itself flagged stays."""
    return [
        replace(sample, flags=(*(flag for flag in sample.flags if flag not in FILTERS), *pair.flags.names(row)))
        for row, sample in enumerate(pair.samples)
    ]
