"""Prints a session's samples and their mean by direction; writes them as a table."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from shared.messages import Sample
from station.app.foam import free_of_foam_m
from station.recording.reader import digest, open_recording
from station.recording.summary import DirectionSummary, by_direction
from station.recording.tables import read_samples, write_samples

NAME = "samples"
HELP = "print a session's samples with mean ± sd by direction; write CSV or Parquet"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("file", type=Path, help="a recording (.mcap), or a table (.csv, .parquet)")
    parser.add_argument("--csv", type=Path, metavar="PATH", help="write the samples as CSV")
    parser.add_argument("--parquet", type=Path, metavar="PATH", help="write the samples as Parquet")
    parser.add_argument("--digest", action="store_true", help="print the SHA-256 of every measured message instead")


def run(args: argparse.Namespace) -> int:
    """Prints and writes what was asked for."""
    if args.digest:
        print(digest(open_recording(args.file)))
        return 0
    terminal, samples = console(), read_samples(args.file)
    show(samples, terminal, source=args.file)
    for path in (args.csv, args.parquet):
        if path is not None:
            write_samples(samples, path, more=free_of_foam_m(samples, args.file))
            terminal.print(f"{len(samples)} samples written to {path}", markup=False)
    return 0


def console() -> Console:
    """The terminal that tables are printed to."""
    # A pipe has no width: the table keeps its own.
    return Console(width=None if sys.stdout.isatty() else 140, highlight=False)


def show(samples: Sequence[Sample], console: Console, *, source: Path) -> None:
    """Prints the samples and their means by direction."""
    if samples:
        console.print(_samples_table(samples))
        console.print(_directions_table(by_direction(samples)))
    else:
        console.print(f"{source} holds no samples: no run of the session came to its end.", markup=False)


def _samples_table(samples: Sequence[Sample]) -> Table:
    table = Table(title="Samples (angles in degrees)", title_justify="left")
    for column in ("run", "direction", "azimuth", "onset", "± sd", "step from", "step to", "dwell s"):
        table.add_column(column, justify="right")
    table.add_column("outcome")
    for sample in samples:
        angles = (sample.azimuth_rad, sample.onset_angle_rad, sample.onset_sigma_rad)
        steps = (sample.step_from_rad, sample.step_to_rad)
        cells = [_direction(sample.direction), *(_degrees(angle) for angle in (*angles, *steps))]
        table.add_row(str(sample.run), *cells, f"{sample.dwell_s:.1f}", _outcome(sample))
    return table


def _outcome(sample: Sample) -> str:
    said = ["no slip up to this angle"] if sample.censored else []
    return escape("; ".join([*said, *sample.flags])) or "kept"


def _directions_table(rows: Sequence[DirectionSummary]) -> Table:
    table = Table(title="Onset angle by direction (kept runs)", title_justify="left")
    for column in ("direction", "kept", "censored", "flagged", "mean °", "sd °", "mean rad", "sd rad"):
        table.add_column(column, justify="right")
    for row in rows:
        counts = (str(row.kept), str(row.censored), str(row.flagged))
        radians = [_or_dash(value, f"{value:.4f}") for value in (row.mean_rad, row.sd_rad)]
        table.add_row(_direction(row.direction), *counts, _degrees(row.mean_rad), _degrees(row.sd_rad), *radians)
    return table


def _direction(direction: int) -> str:
    return "free" if direction < 0 else str(direction)


def _degrees(angle_rad: float) -> str:
    return _or_dash(angle_rad, f"{math.degrees(angle_rad):.2f}")


def _or_dash(value: float, text: str) -> str:
    return "–" if math.isnan(value) else text
