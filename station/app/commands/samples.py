"""Prints a session's samples and their mean by direction; writes them as a table, those of many as a dataset.

Of several recordings, a glob or a folder it prints a row each. With --out they become a Parquet dataset in that folder,
partitioned by rig and session (station/app/many/README.md).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from shared.errors import UserError
from shared.messages import Sample
from shared.notes import note_line
from shared.visible import visible
from station.app.attached import planted_in_recording
from station.app.foam import free_of_foam_m
from station.app.many.dataset import sampling
from station.app.many.named import Chosen
from station.app.many.options import add_files, add_out, add_spreading, chosen_by, work_through
from station.app.many.remote import local
from station.app.many.shown import exit_status
from station.app.sample_tables import ENDS, directions_table, samples_table
from station.app.sentences import print_sentence
from station.recording.malformed import left_out
from station.recording.reader import digest, open_recording
from station.recording.tables import read_samples, write_samples

NAME = "samples"
HELP = "print a session's samples with mean ± sd by direction; write CSV or Parquet"
ONE = "of many recordings, some could not be read"
EXAMPLE = "station samples sim.mcap --csv samples.csv --parquet samples.parquet"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    add_files(parser)
    add_out(parser)
    parser.add_argument("--format", choices=("parquet",), default="parquet", help="the form of the dataset in --out")
    parser.add_argument("--csv", type=Path, metavar="PATH", help="write the samples as CSV")
    parser.add_argument("--parquet", type=Path, metavar="PATH", help="write the samples as Parquet")
    parser.add_argument("--all", action="store_true", help=f"print all rows, not the first and last {ENDS} alone")
    parser.add_argument("--digest", action="store_true", help="print the SHA-256 of every measured message instead")
    parser.add_argument("--json", action="store_true", help="print the rows of many recordings as JSON")
    add_spreading(parser)


def run(args: argparse.Namespace) -> int:
    """Prints and writes what was asked for."""
    found = chosen_by(args)
    if not found.one or args.out is not None or args.json:
        return _many(found, args)
    file, terminal = local(found.names[0]), console()
    if args.digest:
        print(digest(open_recording(file)))
        return 0
    samples, notes = _read(file)
    show(samples, terminal, source=found.names[0], ends=len(samples) if args.all else ENDS)
    for note in notes:
        print_sentence(visible(note))
    for path in (args.csv, args.parquet):
        if path is not None:
            write_samples(samples, path, more=free_of_foam_m(samples, file))
            terminal.print(f"{len(samples)} samples written to {path}", markup=False)
    return 0


def _read(file: Path) -> tuple[tuple[Sample, ...], tuple[str, ...]]:
    """Returns the samples in a file, and sentences on what is in their place and is none, and what the rig conceals."""
    if file.suffix != ".mcap":
        return read_samples(file), ()
    reader = open_recording(file)
    samples, malformed = reader.samples(), left_out(reader.malformed)
    planted = (note_line(note) for note in planted_in_recording(reader))
    return samples, (*((malformed,) if malformed else ()), *planted)


def _many(found: Chosen, args: argparse.Namespace) -> int:
    for name in ("csv", "parquet"):
        if getattr(args, name):
            raise UserError(f"Expected one recording together with --{name}; the samples of many go to --out FOLDER")
    rows = work_through(found, sampling(out=args.out, with_digest=args.digest), args, out=args.out)
    return exit_status(rows)


def console() -> Console:
    """Returns the terminal that tables are printed to."""
    # A pipe has no width: the table keeps its own.
    return Console(width=None if sys.stdout.isatty() else 140, highlight=False)


def show(samples: Sequence[Sample], console: Console, *, source: str | Path, ends: int = ENDS) -> None:
    """Prints the samples, of many the first and the last `ends`, and the means by direction of all."""
    if samples:
        console.print(samples_table(samples, ends=ends))
        console.print(directions_table(samples))
    else:
        console.print(f"{source} holds no samples: no run of the session came to its end.", markup=False)
