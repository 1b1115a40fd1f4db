"""Fig. 8 of the paper: the angle of repose by the place before the slide, in patches of 10 x 10 pixels."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from station.friction.bins import PATCH_PX, heat_map
from station.friction.drawing import LEAST_RANGE_DEG, centres_px, image_size_px, nothing_to_draw
from station.friction.pairs import Pair
from station.pages.drawing import new_figure

NUMBER = 8.0
CAPTION = (
    "Mean angle of repose by the place before the slide: one pixel is a patch of 10×10 camera pixels, the brighter the "
    "higher, black: no sample. Its scale is its own. Compare the paper's Fig. 8."
)
INTERVAL = ""


def draw(pair: Pair) -> Figure:
    """Draws the heat map of the kept slides."""
    figure = new_figure(width_in=4.0, height_in=3.4, equal_scales=True)
    axes: Any = figure.add_subplot()
    axes.set_title(pair.name)
    kept = pair.kept
    width, height = image_size_px(pair.slides)
    patches = heat_map(centres_px(kept.pre_px), np.degrees(kept.theta_rad), size_px=(width, height))
    if not (patches > 0).any():
        nothing_to_draw(axes, "no slide with a known place is left")
        return figure
    colours = mpl.colormaps["inferno"].with_extremes(bad="black")
    rows, columns = patches.shape
    extent = (-0.5, columns * PATCH_PX - 0.5, rows * PATCH_PX - 0.5, -0.5)
    # The scale begins below the lowest value, so that no patch with samples is as black as one without.
    low, high = float(patches[patches > 0].min()), float(patches[patches > 0].max())
    floor = low - 0.25 * max(high - low, LEAST_RANGE_DEG)
    drawn = axes.imshow(patches, cmap=colours, vmin=floor, vmax=high, extent=extent, interpolation="nearest")
    bar = figure.colorbar(drawn, ax=axes, label="angle of repose θ (degrees)")
    bar.ax.set_ylim(low, max(high, low + 1e-4))
    axes.set_xlabel("x before the slide (px)")
    axes.set_ylabel("y (px)")
    return figure
