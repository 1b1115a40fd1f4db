"""Tells of many recordings: a row each, a line that sums them up, or one JSON document, and the exit status."""

from __future__ import annotations

import json as encoding
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

from shared.visible import sentence, visible
from station.app.many.each import Result, Row

_STATUS_TEXT = {"done": "done", "kept": "there already", "failed": "could not be read"}


@dataclass(frozen=True, kw_only=True)
class Shown:
    """The columns of a command's table, and the cells of a result in them."""

    columns: tuple[str, ...]
    cells: Callable[[Result], Sequence[str]]


def show(rows: Sequence[Row], shown: Shown, *, json: bool, named_by: str, out: Path | None) -> None:
    """Prints the rows: a list of what each recording alone would print with `--json`, or a table and a summary.

    In the list, a recording that could not be read has its name and its `error`.
    """
    if json:
        failed = {
            row.recording: {named_by: row.recording, "error": row.reason} for row in rows if row.status == "failed"
        }
        print(encoding.dumps([failed.get(row.recording, row.result) for row in rows], indent=1, allow_nan=False))
        return
    console = Console(width=None if sys.stdout.isatty() else 140, highlight=False)
    console.print(table_of(rows, shown))
    for row in rows:
        if row.status == "failed":
            console.print(sentence(f"✗ {row.recording}: {row.reason}"), style="red", markup=False, soft_wrap=True)
    console.print(summary_of(rows) + (f" Results: {out}" if out else ""), markup=False)


def table_of(rows: Sequence[Row], shown: Shown) -> Table:
    """Returns the table, a line a recording; one that could not be read has no figures."""
    table = Table(Column("recording", overflow="fold"), "", *shown.columns)
    for row in rows:
        cells = shown.cells(row.result) if row.status != "failed" else [""] * len(shown.columns)
        table.add_row(*(Text(visible(cell)) for cell in (row.recording, _STATUS_TEXT[row.status], *cells)))
    return table


def summary_of(rows: Sequence[Row]) -> str:
    """Returns the numbers of those that are done, were there already, and could not be read."""
    counts = Counter(row.status for row in rows)
    counted = ", ".join(f"{counts[status]} {said}" for status, said in _STATUS_TEXT.items() if counts[status])
    return f"{len(rows)} recording{'s' * (len(rows) != 1)}: {counted}."


def exit_status(rows: Sequence[Row], *, findings: bool = False) -> int:
    """Returns 2 if none could be read, 1 if some could not or there are findings, else 0."""
    failed = sum(row.status == "failed" for row in rows)
    return 2 if failed == len(rows) else int(failed > 0 or findings)
