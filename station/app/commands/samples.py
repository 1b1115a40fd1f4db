"""Prints a session's samples and their mean by direction; writes them as a table."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from shared.messages import Sample
from station.app.foam import free_of_foam_m
from station.app.sample_tables import ENDS, directions_table, samples_table
from station.recording.reader import digest, open_recording
from station.recording.tables import read_samples, write_samples

NAME = "samples"
HELP = "print a session's samples with mean ± sd by direction; write CSV or Parquet"
EXAMPLE = "station samples sim.mcap --csv samples.csv --parquet samples.parquet"


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
            write_samples(samples, path, more=free_of_foam_m(samples, args.file))
            terminal.print(f"{len(samples)} samples written to {path}", markup=False)
    return 0


def console() -> Console:
    """The terminal that tables are printed to."""
    # A pipe has no width: the table keeps its own.
    return Console(width=None if sys.stdout.isatty() else 140, highlight=False)


def show(samples: Sequence[Sample], console: Console, *, source: Path, ends: int = ENDS) -> None:
    """Prints the samples, of many the first and the last `ends`, and the means by direction of all."""
    if samples:
        console.print(samples_table(samples, ends=ends))
        console.print(directions_table(samples))
    else:
        console.print(f"{source} holds no samples: no run of the session came to its end.", markup=False)
