"""The style of the reports' figures: colours, type, and an empty figure."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

BEFORE, AFTER, FLOOR, MARKED = "#999999", "#0072b2", "#009e73", "#d55e00"
"""Colours of the plain model, the found model, the repeatability floor and what stands out; the colour-blind can tell
them apart (Okabe, Ito)."""

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Colours of the same set for what has no meaning of its own, such as sensors beside each other."""

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
    "pdf.fonttype": 42,  # fonts that can be edited
    "svg.fonttype": "none",  # text stays text: it can be searched, and the file is small
    "svg.hashsalt": "station",  # the same figure gives the same bytes
}


def style() -> Any:
    """Returns the matplotlib context in which figures are drawn and saved."""
    return mpl.rc_context(_STYLE)  # pyright: ignore[reportArgumentType]  # its keys are typed as literals


def new_figure(*, width_in: float = 9.0, height_in: float = 3.2) -> Any:
    """Returns an empty figure."""
    return Figure(figsize=(width_in, height_in), layout="constrained", facecolor="white")
