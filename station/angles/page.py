"""A comparison of angle sensors as a page of its own: Table I, Fig. 3, and the fitted model of each sensor."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from station.angles.compare import Comparison
from station.angles.figure import drawn_svg
from station.angles.report import fit_table, remarks_of, table_one
from station.pages.page import whole_page

_STYLE = "td { text-align: right; white-space: nowrap; } td:first-child { text-align: left; }"
_CAPTION = (
    "Fig. 3: the difference of every source from the reference at each angle, mean and standard deviation (bars) of "
    "{readings} readings at {stops} stops; triangles point the way in which the plate was moved; lines are the fitted "
    "offset and gain."
)


def comparison_page(comparison: Comparison, *, source: str) -> str:
    """The page as HTML; `source` is the recording's path, which its command names."""
    sensors = ", ".join(fit.source for fit in comparison.fits)
    readings = sum(fit.readings for fit in comparison.fits)
    lead = f"{readings} readings of {sensors} at {comparison.stops} stops of the plate."
    caption = _CAPTION.format(readings=readings, stops=comparison.stops)
    body = [
        "<h1>Angle sensors compared</h1>",
        f"<p>{escape(lead)}</p>",
        *(f"<p>{escape(remark)}</p>" for remark in remarks_of(comparison)),
        _table(*table_one(comparison)),
        f"<figure>{drawn_svg(comparison)}<figcaption>{escape(caption)}</figcaption></figure>",
        _table(*fit_table(comparison)),
        f"<footer><p>Made by <code>station compare-angles --from {escape(source)}</code></p></footer>",
    ]
    return whole_page(title="Angle sensors compared", body="\n".join(body), style=_STYLE)


def _table(title: str, rows: Sequence[Sequence[str]]) -> str:
    lines = [f"<div class='wide'><table><caption>{escape(title)}</caption>", _row(rows[0], "th")]
    return "\n".join([*lines, *(_row(row, "td") for row in rows[1:]), "</table></div>"])


def _row(cells: Sequence[str], kind: str) -> str:
    return "<tr>" + "".join(f"<{kind}>{escape(cell)}</{kind}>" for cell in cells) + "</tr>"
