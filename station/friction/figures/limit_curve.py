"""The limit curve over the circle of directions, with what it was fitted to and what a mean of bins makes of it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from station.friction.bins import by_direction
from station.friction.direction import Array
from station.friction.drawing import FLAGGED, KEPT, nothing_to_draw, settle_radius
from station.friction.limit_curve.choice import Choice
from station.friction.limit_curve.estimates import band_of
from station.friction.limit_curve.observations import Observations, observations_of
from station.friction.limit_curve.of_pair import chosen_curve
from station.friction.pairs import Pair
from station.pages.drawing import new_figure

NUMBER = 11.0
CAPTION = (
    "Limit curve. Left: friction by the direction of the slide (median of all runs), each slide a dot (n of them), "
    "and the paper's mean of 32 bins as squares. Right: what holds the block against a pull, by the pull's "
    "direction, which is what a tilt measures; triangles are censored samples, which ended without a slide and would "
    "have taken more. What lies beyond the rim is drawn on it. Directions are against the object, or the plate where "
    "the curve is fixed to that; a curve of both is drawn for an object that is not turned on the plate."
)
INTERVAL = "shaded: 90 % interval"
_BINS = 32
_RIM = 1.6
"""The rim of the plot over the curve's highest value: a run that the foam held would else make a point of the curve."""


def draw(pair: Pair) -> Figure:
    """Draws the fitted curve in polar coordinates: by slide, and by pull."""
    figure = new_figure(width_in=6.8, height_in=3.9, equal_scales=True)
    figure.suptitle(pair.name)
    try:
        choice = chosen_curve(pair)
    except ValueError as error:
        nothing_to_draw(figure.add_subplot(), str(error))
        return figure
    runs = observations_of(pair)
    slides: Any = figure.add_subplot(1, 2, 1, projection="polar")
    pulls: Any = figure.add_subplot(1, 2, 2, projection="polar")
    _draw_slides(slides, choice, runs, pair)
    _draw_pulls(pulls, choice, runs)
    for axes, title in ((slides, "friction µ by slide"), (pulls, "limit by pull")):
        axes.set_title(title)
        axes.grid(linewidth=0.4, color="0.8")
        axes.spines["polar"].set_linewidth(0.5)
        settle_radius(axes, top=_rim(choice))
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.08), ncols=2)
    return figure


def _draw_slides(axes: Any, choice: Choice, runs: Observations, pair: Pair) -> None:
    band, plate = band_of(choice.best), choice.best.layout.frame == "plate"
    turn = runs.orientation_rad if plate else 0.0
    # The pull's part along the slide is what friction does there.
    mu = np.exp(runs.pull) * np.cos(runs.slide_rad - runs.towards_object_rad)
    mu = np.minimum(mu, _rim(choice))
    _draw_runs(axes, runs.slide_rad + turn, mu, name="slide")
    kept = pair.kept
    bins = by_direction(kept.plate_rad if plate else kept.object_rad, kept.mu, span_rad=2 * math.pi, bins=_BINS)
    axes.plot(bins.middle_rad, bins.mean, "s", color="#e69f00", markersize=3, label="mean of bin")
    phi = np.array([*band.phi_rad, band.phi_rad[0] + 2 * math.pi])
    low, mid, high = (np.array([*row, row[0]]) for row in (band.low, band.mu, band.high))
    axes.fill_between(phi, low, high, color=FLAGGED, alpha=0.3, linewidth=0, label="90 % interval")
    axes.plot(phi, mid, color=FLAGGED, label="limit curve")


def _draw_pulls(axes: Any, choice: Choice, runs: Observations) -> None:
    towards = runs.towards_plate_rad if choice.best.layout.frame == "plate" else runs.towards_object_rad
    pull, above = (np.minimum(np.exp(each), _rim(choice)) for each in (runs.pull, runs.above))
    _draw_runs(axes, towards, pull, name="onset")
    censored = runs.censored
    if censored.any():
        label = f"censored (n = {int(censored.sum())})"
        axes.plot(towards[censored], above[censored], "^", color="#0072b2", markersize=3, label=label)
    phi = np.linspace(0, 2 * math.pi, 181)
    axes.plot(phi, choice.best.layout.curve(choice.best.values).force(phi), color=FLAGGED, label="limit curve")


def _draw_runs(axes: Any, direction_rad: Array, mu: Array, *, name: str) -> None:
    """Draws a dot for each run that has both numbers, and counts them in the legend."""
    seen = np.isfinite(direction_rad) & np.isfinite(mu)
    axes.scatter(
        direction_rad[seen],
        mu[seen],
        s=_dot(len(mu)),
        color=KEPT,
        linewidths=0,
        alpha=0.5,
        rasterized=True,
        label=f"{name} (n = {int(seen.sum())})",
    )


def _rim(choice: Choice) -> float:
    circle = np.linspace(0, 2 * math.pi, 181)
    return _RIM * float(choice.best.layout.curve(choice.best.values).force(circle).max())


def _dot(number: int) -> float:
    return float(np.clip(1500 / max(number, 1), 2, 10))
