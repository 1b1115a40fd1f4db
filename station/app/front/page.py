"""Shows an object in a notebook: a piece of HTML with its own style, which fetches nothing and runs nothing."""

from __future__ import annotations

from html import escape

from rich.table import Table

from station.pages import pieces

_STYLE = """\
.station { color: #1a1a1a; background: #fff; padding: .4rem .8rem; font: 14px/1.45 system-ui, sans-serif; }
.station h2 { font-size: 1.1rem; margin: 1.2rem 0 .4rem; }
.station .verdict { font-size: 1.3rem; font-weight: 600; border-left: 6px solid; padding-left: .8rem; }
.station .yes { border-color: #009e73; } .station .maybe { border-color: #e69f00; }
.station .no { border-color: #0072b2; } .station .cannot { border-color: #d55e00; }
.station .about, .station figcaption, .station .note { color: #555; font-size: .85rem; max-width: 50rem; }
.station li.finding { color: #a3161a; }
.station .whole { white-space: nowrap; } .station .wide { overflow-x: auto; }
.station table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .85rem; margin: .6rem 0; }
.station caption { text-align: left; font-weight: 600; padding: .3rem 0; color: inherit; }
.station th, .station td { padding: .2rem .7rem; text-align: left; vertical-align: top; }
.station th { border-bottom: 1px solid #888; white-space: nowrap; } .station td { border-bottom: 1px solid #e4e4e4; }
.station figure { margin: .8rem 0; overflow-x: auto; }
.station svg { max-width: 100%; height: auto; } .station img { max-width: min(100%, 44rem); height: auto; }
"""


def fragment(*parts: str) -> str:
    """Returns the parts under one style that holds for them alone."""
    return f'<div class="station"><style>\n{_STYLE}</style>{"".join(parts)}</div>'


def html_table(table: Table) -> str:
    """Returns a table for the terminal as HTML, with its title."""
    cells = [[escape(str(cell)) for cell in column.cells] for column in table.columns]
    head = [str(column.header) for column in table.columns]
    return pieces.table(head, list(zip(*cells, strict=True)), caption=str(table.title or ""))
