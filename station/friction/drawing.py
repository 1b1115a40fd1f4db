"""Gives every figure of a surface pair its look, and makes a file of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from station.friction.direction import Array
from station.friction.pairs import Pair
from station.friction.slides import Slides
from station.pages.caption import Caption
from station.pages.drawing import MARKED, style
from station.pages.figure import png_of, save

KEPT = "0.25"
FLAGGED = MARKED
DIRECTION_COLOURS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7")
"""The colours of the four tilting directions, which colour-blind readers can tell apart, too (Okabe and Ito)."""
_RINGS = 4
Draw = Callable[[Pair], Figure]


def picture(draw: Draw, pair: Pair, *, caption: Caption) -> bytes:
    """Returns a figure as the bytes of a PNG."""
    with style():
        return png_of(draw(pair), caption)


def render(draw: Draw, pair: Pair, *, folder: Path, stem: str, caption: Caption) -> bytes:
    """Writes a figure as STEM.png, STEM.svg and STEM.pdf; gives the PNG's bytes.

    Raises:
        UserError: if the folder cannot be written to.
    """
    with style():
        figure = draw(pair)
        png = png_of(figure, caption)
        # The layout is found; finding it again for the second file would take as long as drawing.
        figure.set_layout_engine("none")
        save(figure, folder, stem, caption, png=png)
    return png


LEAST_MARGIN_DEG, LEAST_RANGE_DEG = 1.0, 0.5
"""The least room beside a curve of angles, and the least range of a scale of colours: equal angles have neither."""


def radians_beside(axes: Any) -> None:
    """Adds a second scale in radians, which the paper has, at the right of an axis in degrees."""
    beside = axes.secondary_yaxis("right", functions=(np.radians, np.degrees))
    beside.set_ylabel("rad")


def settle_radius(axes: Any, *, top: float) -> None:
    """Sets a polar plot's radius from 0 to `top`, with few enough numbers to be read."""
    axes.set_rlim(0, top)
    axes.yaxis.set_major_locator(MaxNLocator(_RINGS, prune="both"))
    axes.tick_params(axis="y", labelsize=6.0)


def image_size_px(slides: Slides) -> tuple[int, int]:
    """Returns the width and height of the image: the paper's 600 × 600, or more where corners were seen beyond."""
    seen = np.concatenate([slides.pre_px.reshape(-1, 2), slides.post_px.reshape(-1, 2)])
    seen = seen[np.isfinite(seen).all(axis=1)]
    reach = seen.max(axis=0) if len(seen) else np.zeros(2)
    return max(600, int(reach[0]) + 1), max(600, int(reach[1]) + 1)


def nothing_to_draw(axes: Any, sentence: str) -> None:
    """Says in the figure's place why it is empty."""
    axes.set_axis_off()
    axes.text(0.5, 0.5, sentence, ha="center", va="center", wrap=True, transform=axes.transAxes)


def centres_px(corners: Array) -> Array:
    """Returns centres (n, 2) of marks with corners (n, 4, 2)."""
    return corners.mean(axis=1)
