"""Friction over the whole circle of directions against the object, with the harmonics that the test fits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from station.friction.anisotropy import can_test, fit_harmonics
from station.friction.bins import BINS, by_direction
from station.friction.drawing import FLAGGED, nothing_to_draw
from station.friction.pairs import Pair
from station.pages.drawing import new_figure

NUMBER = 10.0
CAPTION = (
    "Friction coefficient by direction over the whole circle: the mean of 32 bins, and the harmonics that the test of "
    "anisotropy fits (coloured dots: only where there are samples). Left against the object, by the mark's identity; "
    "right against the plate."
)
INTERVAL = "bars: ± 1 standard error"


def draw(pair: Pair) -> Figure:
    """Bins and fit against the object and against the plate."""
    figure = new_figure(width_in=6.6, height_in=3.0)
    figure.suptitle(pair.name)
    kept = pair.kept
    panels: Any = figure.subplots(1, 2, sharey=True)
    for axes, relation, direction in zip(panels, ("object", "plate"), (kept.object_rad, kept.plate_rad), strict=True):
        bins = by_direction(direction, kept.mu, span_rad=2 * math.pi, bins=BINS)
        if not bins.count.any():
            nothing_to_draw(axes, "no slide with a known direction is left")
            continue
        error = np.where(bins.count > 1, bins.sd / np.sqrt(np.maximum(bins.count, 1)), 0.0)
        axes.errorbar(
            np.degrees(bins.middle_rad), bins.mean, yerr=error,
            fmt="o", color="black", markersize=3, elinewidth=0.8, label="mean ± se",
        )  # fmt: skip
        if can_test(kept, relation):
            fit = fit_harmonics(kept, relation)
            axes.plot(np.degrees(fit.grid_rad), fit.mu, ".", color=FLAGGED, markersize=3, label="harmonics 1 and 2")
        axes.set(xlim=(0, 360), xticks=range(0, 361, 60))
        axes.set_xlabel(f"sliding direction against the {relation} (degrees)")
        axes.spines["right"].set_visible(False)
        axes.legend(loc="lower right", ncols=2)
    panels[0].set_ylabel("friction coefficient µ")
    if panels[0].has_data():
        low, high = panels[0].get_ylim()
        panels[0].set_ylim(max(0.0, low - 0.2 * (high - low)), high)
    return figure
