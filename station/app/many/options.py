"""The options of a command that takes many recordings, and how it works on them: with progress, to the last."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console

from shared.errors import UserError
from station.app.bars import bar
from station.app.many.each import Kept, Row, Work, each
from station.app.many.index import write_index
from station.app.many.named import Chosen, chosen, size_bytes
from station.app.many.shown import Shown, show
from station.app.progress import ProgressLines
from station.cluster import cluster

_WORTH_A_PROCESS_BYTES = 400_000_000
"""Bytes below which starting processes takes longer than they save: some two seconds of reading."""


@dataclass(frozen=True, kw_only=True)
class Command:
    """The work of a command on each recording.

    `asked` are the options on which its results depend; `named_by` is the entry of a result that has the recording's
    name; `quick` is True if the work is little more than reading.
    """

    name: str
    work: Work
    asked: Mapping[str, Any]
    shown: Shown
    named_by: str = "recording"
    quick: bool = True


def add_files(parser: argparse.ArgumentParser, *, tables: bool = True) -> None:
    """Declares the recordings."""
    kinds = "recordings (.mcap)" + (" or tables (.csv, .parquet)" if tables else "")
    where = "files, globs, folders, addresses (s3://…, https://…)"
    parser.add_argument("files", nargs="+", metavar="FILE", help=f"{kinds}: {where}")


def add_spreading(parser: argparse.ArgumentParser) -> None:
    """Declares how the work is spread."""
    parser.add_argument("--jobs", type=int, default=0, help="processes; 0: one for each core, where that saves time")
    parser.add_argument("--backend", default="", metavar="dask=ADDRESS|ray", help="your own cluster does the work")


def add_out(parser: argparse.ArgumentParser, *, instead: str = "") -> None:
    """Declares the output folder; `instead` says what it is without the option."""
    said = f"keep each recording's result here, and take those that are there already{instead and f' ({instead})'}"
    parser.add_argument("--out", type=Path, metavar="FOLDER", help=said)


def chosen_by(options: argparse.Namespace, *, tables: bool = True) -> Chosen:
    """Returns the recordings that were named.

    Raises:
        UserError: if a word names nothing, or for a number of processes that is none.
    """
    if options.jobs < 0:
        raise UserError(f"Expected --jobs of 0 or more, got {options.jobs}")
    return chosen(options.files, tables=tables)


def work_through(found: Chosen, command: Command, options: argparse.Namespace, *, out: Path | None) -> list[Row]:
    """Works on all recordings, shows the rows and writes the index; those that are done also if it is broken off.

    Args:
        found: the recordings.
        command: what is done.
        options: with `jobs` and `backend`, and perhaps `json`.
        out: where results are kept; None: nowhere.

    Raises:
        UserError: if the cluster or the output folder cannot be used.
    """
    kept = Kept.of(_made(out), command.name, command.asked, named_by=command.named_by) if out else None
    rows = list[Row]()
    with cluster(options.backend):
        try:
            _each(found, command, options, kept, rows)
        except BaseException:
            _say_stopped(rows, found, out)
            raise
        finally:
            rows.sort(key=lambda row: found.names.index(row.recording))
            if kept:
                write_index(kept, rows)
            if rows:
                show(rows, command.shown, json=getattr(options, "json", False), named_by=command.named_by, out=out)
    return rows


def _each(found: Chosen, command: Command, options: argparse.Namespace, kept: Kept | None, rows: list[Row]) -> None:
    """Adds the rows as they come, with a bar on a terminal and a line now and then in a log."""
    console = Console(stderr=True, highlight=False)
    lines = ProgressLines(console, total=len(found.names), what="recordings")
    with bar(console, in_a_log=False) as progress:
        shown = progress.add_task(command.name, total=len(found.names))

        def take(row: Row) -> None:
            rows.append(row)
            progress.advance(shown)
            lines.at(len(rows))

        each(found.names, command.work, kept=kept, jobs=_jobs(found, command, options), as_it_comes=take)


def _say_stopped(rows: list[Row], found: Chosen, out: Path | None) -> None:
    after = "the same command goes on from here" if out else "with --out FOLDER the same command would go on from here"
    print(f"Stopped after {len(rows)} of {len(found.names)} recordings; {after}.", file=sys.stderr)


def _made(out: Path) -> Path:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"Expected to write to the folder {out}, but that failed: {error.strerror}") from error
    return out


def _jobs(found: Chosen, command: Command, options: argparse.Namespace) -> int:
    """Returns the number of processes: one where starting others takes longer than they save."""
    if options.jobs or options.backend or not command.quick:
        return options.jobs
    size = size_bytes(found.names)
    return 1 if size is not None and size < _WORTH_A_PROCESS_BYTES else 0
