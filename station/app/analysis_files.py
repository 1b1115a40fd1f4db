"""The files of an analysis: report, figures, samples with their flags, limit curves, and a view for Rerun."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from shared import installed
from shared.errors import UserError
from shared.messages import Sample
from station.app.outputs import write_text
from station.friction.drawing import render
from station.friction.figures import figure_kinds
from station.friction.filters import FILTERS
from station.friction.pairs import Pair
from station.friction.report import Picture, caption_of, html_report
from station.friction.report_tables import ReportTable
from station.friction.results import PairResult, limit_curve_table
from station.recording.tables import write_samples

FIGURES_RRD = "figures.rrd"


def write_results(
    results: Sequence[PairResult],
    folder: Path,
    *,
    sources: Sequence[str],
    first: Sequence[ReportTable] = (),
    notes: Sequence[str] = (),
) -> list[str]:
    """Writes them into the folder; the `notes` and the tables `first` stand before the analysis's own tables.

    Report and figures name the command of `made_by`.

    Returns:
        Lines that say where the files are, after those that say what was left out because an extra is missing.

    Raises:
        UserError: if the folder cannot be written to.
    """
    figures = folder / "figures"
    try:
        figures.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"Expected to write to the folder {folder}, but that failed: {error.strerror}") from error
    pictures = {result.pair.name: draw_figures(result.pair, figures) for result in results}
    samples = flagged(results)
    write_samples(samples, folder / "samples.csv")
    no_parquet = _unless_installed(lambda: write_samples(samples, folder / "samples.parquet"))
    page = html_report(results, sources=sources, pictures=pictures, first=first, notes=notes)
    write_text(folder / "report.html", page, what="report")
    curves = json.dumps(limit_curve_table(results), indent=1, allow_nan=False)
    write_text(folder / "limit_curves.json", curves, what="limit curves")
    no_rrd = _unless_installed(lambda: _write_rrd(results, folder / FIGURES_RRD, first=first))
    return [
        *no_parquet,
        *no_rrd,
        f"\nReport: {folder / 'report.html'}",
        f"Figures: {figures}" + ("" if no_rrd else f", in Rerun: rerun {folder / FIGURES_RRD}"),
        f"Samples: {folder / 'samples.csv'}" + ("" if no_parquet else ", .parquet"),
        f"Limit curves: {folder / 'limit_curves.json'}",
    ]


def flagged(results: Sequence[PairResult]) -> list[Sample]:
    """Returns the samples with the filters' names; what the session itself flagged stays."""
    return [sample for result in results for sample in _flagged(result.pair)]


def _flagged(pair: Pair) -> list[Sample]:
    return [
        replace(sample, flags=(*(flag for flag in sample.flags if flag not in FILTERS), *pair.flags.names(row)))
        for row, sample in enumerate(pair.samples)
    ]


def draw_figures(pair: Pair, folder: Path, *, names: Sequence[str] = ()) -> list[Picture]:
    """Draws a pair's figures, or those of some names, into a folder, as PNG, SVG and PDF.

    Raises:
        UserError: if the folder cannot be written to.
    """
    stem = re.sub(r"\W+", "-", pair.name).strip("-")
    kinds = [kind for kind in figure_kinds() if not names or kind.name in names]
    return [
        Picture(
            kind,
            render(kind.draw, pair, folder=folder, stem=f"{stem}_{kind.name}", caption=caption_of(kind, pair)),
        )
        for kind in kinds
    ]


def _write_rrd(results: Sequence[PairResult], path: Path, *, first: Sequence[ReportTable]) -> None:
    from station.view.analysis.rrd import write_analysis  # noqa: PLC0415  # a station without a viewer lacks its package

    write_analysis(results, path, first=first)


def _unless_installed(write: Callable[[], None]) -> list[str]:
    """Writes a file that needs an extra; gives a line that says what is missing, if it is."""
    try:
        write()
    except ModuleNotFoundError as missing:
        return [f"A file is left out. {installed.sentence_of(missing) or missing}"]
    return []
