"""The heat map of residuals: every channel against every covariate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.patches import Rectangle

from station.diagnosis.observations.covariates import TITLES
from station.diagnosis.report import scales
from station.diagnosis.report.picture_data import Spot
from station.pages.drawing import MARKED, new_figure

_PHASES = ("camera at rest", "pre-slip", "onset", "slide", "stop")
_COLUMNS = ("all", *TITLES)
_CLEAR = 0.05
_DARK = 0.6
_SCALED = 3
"""The number of rows from which on there is room for the colour scale; the numbers say the same."""


def heat_map(spots: Sequence[Spot], *, title: str) -> Any:
    """The heat map: a row for each phase and channel, a column for each covariate.

    The colour and the upper number are the effect size, the lower number is the corrected p. A frame marks p < 0.05 in
    the whole search; an empty cell cannot be tested.
    """
    rows = sorted({(_order(spot.phase), spot.phase, spot.channel) for spot in spots})
    there = {spot.covariate for spot in spots}
    columns = [name for name in _COLUMNS if name in there] + sorted(there - set(_COLUMNS))
    figure = new_figure(width_in=max(6.0, 2.6 + 0.62 * len(columns)), height_in=1.7 + 0.46 * len(rows))
    axes = figure.add_subplot()
    sizes = np.full((len(rows), len(columns)), np.nan)
    for spot in spots:
        row, column = rows.index((_order(spot.phase), spot.phase, spot.channel)), columns.index(spot.covariate)
        sizes[row, column] = spot.effect_size
        _label(axes, row, column, spot)
    image = axes.imshow(sizes, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    names = [scales.short(name) for name in columns]
    axes.set_xticks(range(len(columns)), names, rotation=40, ha="right", rotation_mode="anchor")
    axes.set_yticks(range(len(rows)), [f"{phase}: {scales.channel(name)}" for _, phase, name in rows])
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set_title(title, loc="left")
    if len(rows) >= _SCALED:
        figure.colorbar(image, ax=axes, label="effect size", shrink=0.9, pad=0.01)
    return figure


def _label(axes: Any, row: int, column: int, spot: Spot) -> None:
    p = "≤1e-6" if spot.p <= 1e-6 else f"{spot.p:.1g}"
    shade = "white" if spot.effect_size > _DARK else "#333333"
    axes.text(
        column, row, f"{spot.effect_size:.2f}\np {p}", ha="center", va="center", color=shade, fontsize=7.0, zorder=4
    )
    if spot.p < _CLEAR:
        corner = (column - 0.47, row - 0.46)
        axes.add_patch(Rectangle(corner, 0.94, 0.92, fill=False, edgecolor=MARKED, linewidth=1.6, zorder=3))


def _order(phase: str) -> int:
    return _PHASES.index(phase) if phase in _PHASES else len(_PHASES)
