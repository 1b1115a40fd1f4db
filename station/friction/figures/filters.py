"""Fig. 6 of the paper: what each of the four filters flagged, in vermilion."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from station.friction.direction import Array
from station.friction.drawing import FLAGGED, KEPT, centres_px, image_size_px, nothing_to_draw
from station.friction.filters import DISTANCE_PX
from station.friction.pairs import Pair
from station.friction.slides import Bools, Slides
from station.pages.drawing import new_figure

NUMBER = 6.0
CAPTION = (
    "The filters: distance, angle, circumference before against after the slide, and the slides that ran along the "
    "foam. Vermilion: flagged. Pixels are those of the picture, in which the filters judge as the paper's do; "
    "millimetres at the upper edge are by the median slide. Compare the paper's Fig. 6."
)
INTERVAL = ""
_MOST_BINS = 60
_MOST_STEPS = 4
"""Steps between the numbers under a panel of three inches: five of seven digits have room."""


def draw(pair: Pair) -> Figure:
    """Draws the four panels."""
    figure = new_figure(width_in=6.6, height_in=5.6)
    panels: Any = figure.subplots(2, 2)
    slides, flags = pair.slides, pair.flags.by_filter
    titles = ("(a) Distance", "(b) Angle", "(c) Circumference", "(d) Border")
    for axes, title, name in zip(panels.flat, titles, flags, strict=True):
        applicable = pair.flags.applicable[name]
        axes.set_title(f"{title} filter: {int(flags[name].sum())} of {int(applicable.sum())} flagged")
        if not applicable.any():
            nothing_to_draw(axes, "not judged: there is no calibration" if name == "border" else "no slide to judge")
    distance, angle, around, border = panels.flat
    applicable = pair.flags.applicable
    if applicable["distance"].any():
        _histogram(distance, slides.distance_px, applicable["distance"], flags["distance"])
        distance.axvline(DISTANCE_PX, color=FLAGGED, linewidth=0.8, linestyle="--")
        distance.set_xlabel("sliding distance (px)")
        _millimetres_above(distance, slides)
        _circumferences(around, slides.circumference_px, applicable["circumference"], flags["circumference"])
    if applicable["angle"].any():
        _histogram(angle, np.degrees(slides.theta_rad), applicable["angle"], flags["angle"])
        angle.set_xlabel("angle of repose θ (degrees)")
    if applicable["border"].any():
        _paths(border, pair)
    figure.suptitle(pair.name)
    return figure


def _histogram(axes: Any, values: Array, applicable: Bools, flagged: Bools) -> None:
    # Some samples in every bin, however few there are.
    bins = int(np.clip(1.5 * np.sqrt(applicable.sum()), 10, _MOST_BINS))
    edges = np.histogram_bin_edges(values[applicable], bins=bins)
    parts = [values[applicable & ~flagged], values[applicable & flagged]]
    axes.hist(parts, bins=edges, stacked=True, color=[KEPT, FLAGGED], label=["kept", "flagged"])
    axes.set_ylabel("samples")
    # A single flagged sample would be a hair beside the others.
    for value in parts[1]:
        axes.plot(value, 0, marker="|", color=FLAGGED, markersize=7, clip_on=False)
    axes.spines["right"].set_visible(False)


def _millimetres_above(axes: Any, slides: Slides) -> None:
    """Adds a second scale in millimetres, where a calibration tells how far blocks slid on the plate."""
    way_m = np.linalg.norm(centres_px(slides.post_m) - centres_px(slides.pre_m), axis=1)
    known = np.isfinite(way_m) & (slides.distance_px > 0)
    if known.any():
        mm = 1e3 * float(np.median(way_m[known] / slides.distance_px[known]))
        above = axes.secondary_xaxis("top", functions=(partial(np.multiply, mm), partial(np.multiply, 1.0 / mm)))
        above.set_xlabel("mm", fontsize="small")


def _circumferences(axes: Any, around: Array, applicable: Bools, flagged: Bools) -> None:
    for chosen, colour, size in ((applicable & ~flagged, KEPT, 5), (applicable & flagged, FLAGGED, 9)):
        axes.scatter(*around[chosen].T, s=size, color=colour, linewidths=0, alpha=0.7, rasterized=True)
    # They differ by tenths of a pixel: numbers of so many digits have no room for as many as matplotlib takes.
    axes.ticklabel_format(useOffset=False)
    axes.locator_params(axis="x", nbins=_MOST_STEPS)
    axes.set_xlabel("circumference before (px)")
    axes.set_ylabel("after (px)")
    axes.spines["right"].set_visible(False)


def _paths(axes: Any, pair: Pair) -> None:
    slides, flags = pair.slides, pair.flags
    ends = np.stack([centres_px(slides.pre_px), centres_px(slides.post_px)], axis=1)
    applicable, flagged = flags.applicable["border"], flags.by_filter["border"]
    for chosen, colour, width in ((applicable & ~flagged, "0.6", 0.4), (applicable & flagged, FLAGGED, 0.8)):
        axes.add_collection(LineCollection(list(ends[chosen]), colors=colour, linewidths=width, rasterized=True))
        axes.scatter(*ends[chosen, 0].T, s=3, color=colour, linewidths=0, rasterized=True)
    foam = _foam_px(pair)
    if foam is not None:
        axes.plot(*foam, color="0.2", linewidth=0.8, linestyle="--")
    width, height = image_size_px(slides)
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), aspect="equal")
    axes.set_xlabel("x (px); dots: before the slide")
    axes.set_ylabel("y (px)")
    for side in ("top", "right"):
        axes.spines[side].set_visible(True)


def _foam_px(pair: Pair) -> Array | None:
    """Returns the foam's edge (2, k) in the image, by the affine map from place to pixel that the marks show."""
    slides = pair.slides
    places = np.concatenate([centres_px(slides.pre_m), centres_px(slides.post_m)])
    pixels = np.concatenate([centres_px(slides.pre_px), centres_px(slides.post_px)])
    known = np.isfinite(places).all(axis=1) & np.isfinite(pixels).all(axis=1)
    if known.sum() < 3 or np.linalg.matrix_rank(np.cov(places[known].T), tol=1e-8) < 2:
        return None
    columns = np.column_stack([places[known], np.ones(known.sum())])
    to_pixel = np.linalg.lstsq(columns, pixels[known])[0]
    turn = np.linspace(0, 2 * np.pi, 181)
    x = pair.opening.x_m + pair.opening.radius_m * np.cos(turn)
    y = pair.opening.y_m + pair.opening.radius_m * np.sin(turn)
    return (np.column_stack([x, y, np.ones_like(x)]) @ to_pixel).T
