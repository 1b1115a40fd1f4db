"""The style of the report's figures, and their form as a part of the page."""

from __future__ import annotations

import io
import re
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

BEFORE, AFTER, FLOOR, MARKED = "#999999", "#0072b2", "#009e73", "#d55e00"
"""Colours of the plain model, the found model, the repeatability floor and what stands out; the colour-blind can tell
them apart (Okabe, Ito)."""

MOST_DOTS = 1500
"""A scatter of more points becomes a bitmap inside the drawing: as vectors it would take megabytes."""

_STYLE: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "lines.linewidth": 1.2,
    "svg.fonttype": "none",  # text stays text: it can be searched, and the file is small
    "svg.hashsalt": "station",  # the same figure gives the same bytes
}


def style() -> Any:
    """The matplotlib context in which figures are drawn and saved."""
    return mpl.rc_context(_STYLE)  # pyright: ignore[reportArgumentType]  # its keys are typed as literals


def new_figure(*, width_in: float = 9.0, height_in: float = 3.2) -> Any:
    """An empty figure."""
    return Figure(figsize=(width_in, height_in), layout="constrained", facecolor="white")


def inline_svg(figure: Any, *, name: str, alt: str) -> str:
    """The figure as an <svg> element with ids of its own and `alt` as its text for screen readers."""
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    drawing = text.getvalue()
    drawing = drawing[drawing.index("<svg") :]
    drawing = _own_ids(drawing, name)
    drawing = re.sub(r"url\(#", f"url(#{name}-", drawing)
    drawing = re.sub(r'href="#', f'href="#{name}-', drawing)
    drawing = re.sub(r"<metadata>.*?</metadata>", "", drawing, flags=re.DOTALL)
    return drawing.replace("<svg ", f'<svg role="img" aria-label="{alt}" ', 1)


def _own_ids(drawing: str, name: str) -> str:
    """The drawing with `name` before each id; matplotlib repeats equal markers' ids, of which only the first stays."""
    seen: set[str] = set()

    def renamed(match: re.Match[str]) -> str:
        known = match[1] in seen
        seen.add(match[1])
        return "" if known else f' id="{name}-{match[1]}"'

    return re.sub(r'\sid="([^"]*)"', renamed, drawing)
