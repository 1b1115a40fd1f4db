"""Pieces of the page: figures, tables and numbers, with everything that comes from outside escaped."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

from station.gap.result import Value


def table(head: Sequence[str], rows: Sequence[Sequence[str]], *, caption: str = "") -> str:
    """A table of cells that are HTML already."""
    title = f"<caption>{escape(caption)}</caption>" if caption else ""
    top = "".join(f"<th>{escape(word)}</th>" for word in head)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<div class="wide"><table>{title}<thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'


def figure(svg: str, caption: str) -> str:
    """A drawing with what it shows below it."""
    return f"<figure>{svg}<figcaption>{escape(caption)}</figcaption></figure>"


def section(title: str, *parts: str, name: str) -> str:
    """A section; `name` is its anchor."""
    return f'<section id="{name}"><h2>{escape(title)}</h2>{"".join(parts)}</section>'


def paragraph(text: str, *, kind: str = "") -> str:
    """A paragraph of plain text."""
    return f'<p class="{kind}">{escape(text)}</p>' if kind else f"<p>{escape(text)}</p>"


def number(value: float, digits: int = 2, *, sign: bool = False) -> str:
    """A number with so many decimals; a dash where there is none."""
    if not math.isfinite(value):
        return "–"
    return f"{value:+.{digits}f}" if sign else f"{value:.{digits}f}"


def p_value(p: float) -> str:
    """A p-value; nothing below one in a million is told apart."""
    return "≤ 1e-6" if p <= 1e-6 else f"{p:.2g}"


def with_error(value: Value) -> tuple[str, str, str]:
    """Value, 90 % interval and unit of a parameter, with the digits that the error leaves."""
    unit = "" if value.unit == "1" else value.unit
    if not math.isfinite(value.sd) or value.sd <= 0:
        return f"{value.value:.3g}", "–", unit
    digits = min(max(0, 1 - math.floor(math.log10(value.sd))), 9)
    low, high = value.interval90
    return f"{value.value:.{digits}f}", f"{low:.{digits}f} … {high:.{digits}f}", unit
