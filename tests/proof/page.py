"""The proof as a page, which looks as the reports of the tool that it proves: gates, then each family."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from station.pages import pieces
from station.pages.page import whole_page
from tests.proof.report import MISSED, RIVAL_COLUMNS, About, Column, made, notes, rival_row, rows

_TITLE = "The proof: what the diagnosis finds in concealed cases"
_WHAT = (
    "Each case is a recording in which somebody else's generator has concealed something. The key's hash was stored "
    "before the tool saw the recording; the tool ran once; then the key was opened and this page was computed. A gate "
    "is what was asked beforehand; a gate that one family misses is marked there and not averaged away."
)
_HOW = "In brackets: 95 % interval (Wilson's for shares, else bootstrapped) and the number of cases."
_STYLE = "th, td { text-align: left; } .missed { color: var(--bad); font-weight: 600; } li { overflow-wrap: anywhere; }"


def html_page(about: About, columns: Sequence[Column]) -> str:
    """The page as HTML, in one file that fetches nothing."""
    body = [
        f"<h1>{escape(_TITLE)}</h1>",
        pieces.paragraph(_verdict(columns)),
        pieces.paragraph(_WHAT, kind="note"),
        _gates(columns),
        *map(_family, columns),
        pieces.made_with(about.command, notes=f"Measured {about.date} ({about.told})."),
    ]
    return whole_page(title=_TITLE, body="\n".join(body), style=_STYLE)


def _verdict(columns: Sequence[Column]) -> str:
    """Counts the gates that were met, and names those that were not, over all families."""
    asked = [(column.title, gate) for column in columns for gate in column.gates if gate.met is not None]
    missed = [f"{gate.title} ({title})" for title, gate in asked if not gate.met]
    told = f"{len(asked) - len(missed)} of {len(asked)} gates are met"
    return f"{told}. Missed: {'; '.join(missed)}." if missed else f"{told}."


def _gates(columns: Sequence[Column]) -> str:
    head = ("figure", "gate", *(column.title for column in columns))
    cells = [[_cell(text) for text in row] for row in rows(columns)]
    return pieces.section("Gates", pieces.table(head, cells, caption="Gates by family", note=_HOW), name="gates")


def _cell(text: str) -> str:
    told = escape(text)
    return f'<span class="missed">{told}</span>' if text.startswith(MISSED) else told


def _family(column: Column) -> str:
    listed = "".join(f"<li>{escape(line)}</li>" for line in notes(column))
    parts = [pieces.paragraph(f"Cases: {made(column)}."), *(one.html for one in column.pictures)]
    if column.lines:
        cells = [[escape(cell) for cell in rival_row(line)] for line in column.lines]
        parts.append(pieces.table(RIVAL_COLUMNS, cells, caption="Rivals on the same cases and folds"))
    return pieces.section(column.title, *parts, f"<ul>{listed}</ul>", name=column.proof.family.name)
