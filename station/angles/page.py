"""A comparison of angle sensors as a page of its own: Table I, Fig. 3, and the fitted model of each sensor."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from html import escape

from station.angles.compare import Comparison
from station.angles.figure import drawn_svg
from station.angles.report import fits_csv, remarks_of, table_csv
from station.pages.page import whole_page

_STYLE = "td { text-align: right; white-space: nowrap; } td:first-child { text-align: left; }"
_TABLE_ONE = "Table I: absolute difference and difference of each two sources, degrees"
_FITS = "Against {reference}: offset, gain and hysteresis with 95 % intervals, noise and scatter, degrees"
_CAPTION = (
    "Fig. 3: the difference of every source from the reference at each angle, mean and standard deviation of the "
    "readings; triangles point the way in which the plate was moved; lines are the fitted offset and gain."
)


def comparison_page(comparison: Comparison, *, source: str) -> str:
    """The page as HTML; `source` is the recording's path, which its command names."""
    sensors = ", ".join(fit.source for fit in comparison.fits)
    readings = sum(fit.readings for fit in comparison.fits)
    lead = f"{readings} readings of {sensors} at {comparison.stops} stops of the plate."
    body = [
        "<h1>Angle sensors compared</h1>",
        f"<p>{escape(lead)}</p>",
        *(f"<p>{escape(remark)}</p>" for remark in remarks_of(comparison)),
        _table(table_csv(comparison), _TABLE_ONE),
        f"<figure>{drawn_svg(comparison)}<figcaption>{escape(_CAPTION)}</figcaption></figure>",
        _table(fits_csv(comparison), _FITS.format(reference=comparison.reference)),
        f"<footer><p>Made by <code>station compare-angles --from {escape(source)}</code></p></footer>",
    ]
    return whole_page(title="Angle sensors compared", body="\n".join(body), style=_STYLE)


def _table(text: str, title: str) -> str:
    head, *rows = csv.reader(io.StringIO(text))
    lines = [f"<div class='wide'><table><caption>{escape(title)}</caption>", _row(head, "th")]
    return "\n".join([*lines, *(_row([_rounded(cell) for cell in row], "td") for row in rows), "</table></div>"])


def _row(cells: Sequence[str], kind: str) -> str:
    return "<tr>" + "".join(f"<{kind}>{escape(cell.replace('_', ' '))}</{kind}>" for cell in cells) + "</tr>"


def _rounded(cell: str) -> str:
    """A number with decimals as a person reads it; everything else as it stands."""
    try:
        return f"{float(cell):.4f}" if "." in cell else cell
    except ValueError:
        return cell or "–"
