"""The conclusions and the tables of an analysis as Markdown."""

from __future__ import annotations

from collections.abc import Sequence

from station.friction.conclusions import conclusions
from station.friction.report_table import ReportTable
from station.friction.report_tables import tables
from station.friction.results import PairResult


def of_pair(result: PairResult) -> str:
    """Returns the sentences about one pair."""
    notes = (f"- {'**!** ' if note.finding else ''}{_plain(note.text)}" for note in conclusions(result))
    return "\n".join([f"# {_plain(result.pair.name)}", "", *notes])


def of_all(results: Sequence[PairResult], *, first: Sequence[ReportTable] = ()) -> str:
    """Returns every table, those of `first` before the analysis's own."""
    return "\n\n".join(_table(table) for table in (*first, *tables(results)))


def _table(table: ReportTable) -> str:
    head = ["## " + table.title, "", _row(table.columns), _row(["---"] * len(table.columns))]
    return "\n".join([*head, *(_row(row) for row in table.rows), "", table.note])


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(_plain(cell) for cell in cells) + " |"


def _plain(text: str) -> str:
    """Names come from the user's files: nothing in them may be taken for markup."""
    return "".join(f"\\{letter}" if letter in r"\`*_[]<>#|" else letter for letter in text)
