"""The style of the reports' figures: colours, type, and an empty figure."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from station.pages.radius import turn_radius_numbers

BEFORE, AFTER, FLOOR, MARKED = "#999999", "#0072b2", "#009e73", "#d55e00"
"""Colours of the plain model, the found model, the repeatability floor and what stands out; the colour-blind can tell
them apart (Okabe, Ito)."""

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Colours of the same set for what has no meaning of its own, such as sensors beside each other."""

MOST_DOTS = 1500
"""A scatter of more points becomes a bitmap inside the drawing: as vectors it would take megabytes."""

_MOST_ROUNDS, _STILL = 6, 1e-3
"""The rounds of a layout at most, the reports' figures needed up to three; and the share of the figure, a pixel, by
which a panel that is still moves at most."""

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


def new_figure(*, width_in: float = 9.0, height_in: float = 3.2, equal_scales: bool = False) -> Any:
    """Returns an empty figure; one whose panels all have `equal_scales`, as a map has, loses the room between them."""
    return Figure(figsize=(width_in, height_in), layout=_Settled(compress=equal_scales), facecolor="white")


class _Settled(ConstrainedLayoutEngine):
    """Lays a figure out until nothing moves any more, what is saved is the first drawing; then places its numbers.

    Panels of equal scales shrink after their layout, and have other numbers beside them then: matplotlib alone cuts
    their labels and legends at the figure's edge (`tests/contracts/test_figures.py` finds such).
    """

    def execute(self, fig: Any) -> None:
        """Lays the figure out."""
        for _ in range(_MOST_ROUNDS):
            before = _places(fig)
            super().execute(fig)
            if np.allclose(before, _places(fig), atol=_STILL):
                break
        for axes in fig.axes:
            if axes.name == "polar":
                turn_radius_numbers(axes)


def _places(figure: Any) -> Any:
    """Returns the edges (n, 4) of panels with equal scales, in shares of the figure; the others stay where they are."""
    return np.array([axes.get_position().extents for axes in figure.axes if axes.get_aspect() != "auto"])
