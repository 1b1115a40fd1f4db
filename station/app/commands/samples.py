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
from station.recording.reader import digest, open_recording
from station.recording.summary import DirectionSummary, by_direction
from station.recording.tables import read_samples, write_samples

NAME = "samples"
HELP = "print a session's samples with mean ± sd by direction; write CSV or Parquet"
EXAMPLE = "station samples sim.mcap --csv samples.csv --parquet samples.parquet"
ENDS = 10
"""Rows at each end of a long table: what fits on a screen together with the table by direction."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("file", type=Path, help="a recording (.mcap), or a table (.csv, .parquet)")
    parser.add_argument("--csv", type=Path, metavar="PATH", help="write the samples as CSV")
    parser.add_argument("--parquet", type=Path, metavar="PATH", help="write the samples as Parquet")
    parser.add_argument("--all", action="store_true", help=f"print all rows, not the first and last {ENDS} alone")
    parser.add_argument("--digest", action="store_true", help="print the SHA-256 of every measured message instead")


def run(args: argparse.Namespace) -> int:
    """Prints and writes what was asked for."""
    if args.digest:
        print(digest(open_recording(args.file)))
        return 0
    terminal, samples = console(), read_samples(args.file)
    show(samples, terminal, source=args.file, ends=len(samples) if args.all else ENDS)
    for path in (args.csv, args.parquet):
        if path is not None:
            write_samples(samples, path)
            terminal.print(f"{len(samples)} samples written to {path}", markup=False)
    return 0


def console() -> Console:
    """The terminal that tables are printed to."""
    # A pipe has no width: the table keeps its own.
    return Console(width=None if sys.stdout.isatty() else 140, highlight=False)


def show(samples: Sequence[Sample], console: Console, *, source: Path, ends: int = ENDS) -> None:
    """Prints the samples, of many the first and the last `ends`, and the means by direction of all."""
    if samples:
        console.print(_samples_table(samples, ends))
        console.print(_directions_table(by_direction(samples)))
    else:
        console.print(f"{source} holds no samples: no run of the session came to its end.", markup=False)


def _samples_table(samples: Sequence[Sample], ends: int) -> Table:
    table = Table(title="Samples (angles in degrees)", title_justify="left")
    for column in ("run", "direction", "azimuth", "onset", "± sd", "step from", "step to", "dwell s"):
        table.add_column(column, justify="right")
    table.add_column("outcome")
    between = samples[ends:-ends] if len(samples) > 2 * ends else ()
    for sample in samples[:ends] if between else samples:
        table.add_row(*_row(sample))
    if between:
        table.add_row("…", *[""] * 7, f"{len(between)} more: station samples FILE --all")
        for sample in samples[-ends:]:
            table.add_row(*_row(sample))
    return table


def _row(sample: Sample) -> tuple[str, ...]:
    angles = (sample.azimuth_rad, sample.onset_angle_rad, sample.onset_sigma_rad)
    steps = (sample.step_from_rad, sample.step_to_rad)
    degrees = (_degrees(angle) for angle in (*angles, *steps))
    return str(sample.run), _direction(sample.direction), *degrees, f"{sample.dwell_s:.1f}", _outcome(sample)


def _outcome(sample: Sample) -> str:
    said = ["no slip up to this angle"] if sample.censored else []
    return escape("; ".join([*said, *sample.flags])) or "kept"


def _directions_table(rows: Sequence[DirectionSummary]) -> Table:
    table = Table(title="Onset angle by direction (kept runs)", title_justify="left")
    for column in ("direction", "kept", "censored", "flagged", "mean °", "sd °"):
        table.add_column(column, justify="right")
    for row in rows:
        counts = (str(row.kept), str(row.censored), str(row.flagged))
        table.add_row(_direction(row.direction), *counts, _degrees(row.mean_rad), _degrees(row.sd_rad))
    return table


def _direction(direction: int) -> str:
    return "free" if direction < 0 else str(direction)


def _degrees(angle_rad: float) -> str:
    return "–" if math.isnan(angle_rad) else f"{math.degrees(angle_rad):.2f}"
