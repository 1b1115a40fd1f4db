"""A comparison of angle sensors as a page of its own: Table I, Fig. 3, and the fitted model of each sensor."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from station.angles.compare import Comparison
from station.angles.figure import counted, shown
from station.angles.report import fit_table, remarks_of, table_one
from station.pages import pieces
from station.pages.caption import command, command_line, made_by
from station.pages.page import whole_page

_STYLE = "td { text-align: right; white-space: nowrap; } td:first-child { text-align: left; }"


def comparison_page(comparison: Comparison, *, source: str) -> str:
    """Returns the page as HTML.

    `source` is the recording's path, which its command (that of `made_by`, or else) names.
    """
    with made_by(command(command_line("station", "compare-angles", **{"from": source}))):
        return whole_page(title="Angle sensors compared", body="\n".join(_body(comparison)), style=_STYLE)


def _body(comparison: Comparison) -> list[str]:
    sensors = ", ".join(fit.source for fit in comparison.fits)
    lead = f"{counted(comparison)} of {sensors}."
    return [
        "<h1>Angle sensors compared</h1>",
        pieces.paragraph(lead),
        *map(pieces.paragraph, remarks_of(comparison)),
        _table(*table_one(comparison)),
        shown(comparison),
        _table(*fit_table(comparison)),
        pieces.made_with(command()),
    ]


def _table(title: str, rows: Sequence[Sequence[str]]) -> str:
    return pieces.table(rows[0], [[escape(cell) for cell in row] for row in rows[1:]], caption=title)
