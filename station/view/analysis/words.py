"""The conclusions and the tables of an analysis as Markdown."""

from __future__ import annotations

from collections.abc import Sequence

from station.friction.conclusions import conclusions
from station.friction.report_table import ReportTable
from station.friction.report_tables import tables
from station.friction.results import PairResult
from station.pages.markdown import inline, row


def of_pair(result: PairResult) -> str:
    """Returns the sentences about one pair."""
    notes = (f"- {'**!** ' if note.finding else ''}{inline(note.text)}" for note in conclusions(result))
    return "\n".join([f"# {inline(result.pair.name)}", "", *notes])


def of_all(results: Sequence[PairResult], *, first: Sequence[ReportTable] = ()) -> str:
    """Returns every table, those of `first` before the analysis's own."""
    return "\n\n".join(_table(table) for table in (*first, *tables(results)))


def _table(table: ReportTable) -> str:
    head = [f"## {inline(table.title)}", "", row(table.columns), "|" + "---|" * len(table.columns)]
    return "\n".join([*head, *map(row, table.rows), "", inline(table.note)])
