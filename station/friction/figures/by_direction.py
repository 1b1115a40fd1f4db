"""Fig. 7 of the paper: the angle of repose by direction relative to the object, in 32 bins over 180 degrees."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from station.friction.bins import Bins, by_direction
from station.friction.drawing import LEAST_MARGIN_DEG, nothing_to_draw, radians_beside
from station.friction.pairs import Pair
from station.pages.drawing import new_figure

NUMBER = 7.0
CAPTION = (
    "Angle of repose by direction relative to the object, as the paper folds it: the mean of 32 bins over 180°, and "
    "below how many samples each has. Dashed: the mean of all. Compare the paper's Fig. 7."
)
INTERVAL = "shaded: ± 1 standard deviation of a bin"


def draw(pair: Pair) -> Figure:
    """Draws mean and standard deviation per bin, with the number of samples below."""
    figure = new_figure(width_in=4.6, height_in=3.4)
    upper: Any
    lower: Any
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[5, 1])
    upper.set_title(pair.name)
    kept = pair.kept
    bins = by_direction(kept.paper_rad, np.degrees(kept.theta_rad))
    if not bins.count.any():
        nothing_to_draw(upper, "no slide with a known direction is left")
        lower.set_axis_off()
        return figure
    _means(upper, bins)
    upper.axhline(float(np.degrees(kept.theta_rad).mean()), color="0.5", linewidth=0.7, linestyle="--", zorder=0)
    upper.set_ylabel("angle of repose θ (degrees)")
    radians_beside(upper)
    lower.bar(np.degrees(bins.middle_rad), bins.count, width=180 / len(bins.count), color="0.7", linewidth=0)
    lower.set(xlim=(0, 180), xticks=range(0, 181, 30))
    lower.set_ylabel("samples")
    lower.set_xlabel("sliding direction relative to the object (degrees)")
    lower.spines["right"].set_visible(False)
    return figure


def _means(axes: Any, bins: Bins) -> None:
    x = np.degrees(bins.middle_rad)
    spread = np.where(np.isnan(bins.sd), 0.0, bins.sd)
    filled = np.isfinite(bins.mean)
    axes.fill_between(x, bins.mean - spread, bins.mean + spread, color="0.82", linewidth=0, label="± 1 sd")
    axes.plot(x, bins.mean, color="black", label="mean")
    # Bins between empty ones would have no line.
    axes.plot(x[filled], bins.mean[filled], ".", color="black", markersize=3)
    low, high = np.nanmin(bins.mean - spread), np.nanmax(bins.mean + spread)
    margin = max(0.5 * (high - low), LEAST_MARGIN_DEG)
    axes.set_ylim(max(0.0, low - margin), high + margin)
    axes.legend(loc="upper right", ncols=2)
