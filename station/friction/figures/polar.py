"""Fig. 9 of the paper: each sample at its sliding direction and angle of repose, a colour per tilting direction."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from station.friction.drawing import DIRECTION_COLOURS, nothing_to_draw, settle_radius
from station.friction.pairs import Pair
from station.friction.slides import Slides
from station.pages.drawing import new_figure

NUMBER = 9.0
CAPTION = (
    "Each dot is a sample: its distance from the centre is the angle of repose (degrees), its angle the sliding "
    "direction relative to the object, its colour the tilting direction. Left as the paper folds it, "
    "0° along the mark's short side, or along a square mark's own x (compare its Fig. 9); right over the whole circle, "
    "which the mark's identity gives, 0° along the mark's own x."
)
INTERVAL = ""


def draw(pair: Pair) -> Figure:
    """Draws the kept slides over the paper's half circle and over the whole one."""
    figure = new_figure(width_in=6.8, height_in=3.6)
    kept = pair.kept
    figure.suptitle(pair.name)
    known = np.isfinite(kept.paper_rad)
    if not known.any():
        nothing_to_draw(figure.add_subplot(), "no slide with a known direction is left")
        return figure
    half: Any = figure.add_subplot(1, 2, 1, projection="polar")
    whole: Any = figure.add_subplot(1, 2, 2, projection="polar")
    slides = kept.where(known)
    half.set_thetalim(0, math.pi)
    for axes, direction in ((half, slides.paper_rad), (whole, slides.object_rad)):
        _dots(axes, slides, direction)
    half.set_title("folded: 180°")
    whole.set_title("by the mark's identity: 360°")
    figure.legend(*whole.get_legend_handles_labels(), loc="outside lower center", ncols=4, markerscale=1.5)
    return figure


def _dots(axes: Any, slides: Slides, direction: Any) -> None:
    # Hundreds of dots need to be small, and a few can be larger.
    size = float(np.clip(1500 / len(slides), 3, 12))
    for number, colour in enumerate(DIRECTION_COLOURS):
        chosen = slides.sector == number
        axes.scatter(
            direction[chosen], np.degrees(slides.theta_rad[chosen]), s=size, color=colour, linewidths=0, alpha=0.7,
            rasterized=True, label=f"tilted about {number * 90}°",
        )  # fmt: skip
    settle_radius(axes, top=1.05 * float(np.degrees(slides.theta_rad.max())))
    axes.set_rlabel_position(22.5)
    axes.grid(linewidth=0.4, color="0.8")
    axes.spines["polar"].set_linewidth(0.5)
