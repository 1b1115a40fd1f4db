"""The heat map of residuals: every channel against every covariate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.patches import Rectangle

from station.diagnosis import thresholds
from station.diagnosis.observations.channel import PHASES
from station.diagnosis.observations.covariates import TITLES
from station.diagnosis.report import scales
from station.diagnosis.report.picture_data import Spot
from station.pages.drawing import MARKED, new_figure

_COLUMNS = ("all", *TITLES)
_DARK = 0.6
_SCALED = 3
"""The number of rows from which on there is room for the colour scale; the numbers say the same."""


def heat_map(spots: Sequence[Spot], *, title: str) -> Any:
    """Returns the heat map: a row for each phase and channel, a column for each covariate.

    The upper number is the effect size, the lower number is the corrected p. A cell whose p is below the level at which
    places are claimed has a frame and the effect size as its colour; all others are pale. An empty cell cannot be
    tested.
    """
    rows = sorted({(_order(spot.phase), spot.phase, spot.channel) for spot in spots})
    there = {spot.covariate for spot in spots}
    columns = [name for name in _COLUMNS if name in there] + sorted(there - set(_COLUMNS))
    figure = new_figure(width_in=max(6.0, 2.6 + 0.62 * len(columns)), height_in=1.7 + 0.46 * len(rows))
    axes = figure.add_subplot()
    sizes = np.full((len(rows), len(columns)), np.nan)
    for spot in spots:
        row, column = rows.index((_order(spot.phase), spot.phase, spot.channel)), columns.index(spot.covariate)
        sizes[row, column] = _shown(spot)
        _label(axes, row, column, spot)
    image = axes.imshow(sizes, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    names = [scales.short(name) for name in columns]
    axes.set_xticks(range(len(columns)), names, rotation=40, ha="right", rotation_mode="anchor")
    axes.set_yticks(range(len(rows)), [f"{phase}: {scales.channel(name)}" for _, phase, name in rows])
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set_title(title, loc="left")
    if len(rows) >= _SCALED:
        figure.colorbar(image, ax=axes, label=f"effect size where p < {thresholds.LEVEL:g}", shrink=0.9, pad=0.01)
    return figure


def _shown(spot: Spot) -> float:
    """Returns the effect size where it is beyond chance, else 0.

    A smooth curve through few residuals takes up most of them.
    """
    return spot.effect_size if spot.p < thresholds.LEVEL else 0.0


def _label(axes: Any, row: int, column: int, spot: Spot) -> None:
    p = "≤1e-6" if spot.p <= 1e-6 else f"{spot.p:.1g}"
    shade = "white" if _shown(spot) > _DARK else "#333333"
    axes.text(
        column, row, f"{spot.effect_size:.2f}\np {p}", ha="center", va="center", color=shade, fontsize=7.0, zorder=4
    )
    if spot.p < thresholds.LEVEL:
        corner = (column - 0.47, row - 0.46)
        axes.add_patch(Rectangle(corner, 0.94, 0.92, fill=False, edgecolor=MARKED, linewidth=1.6, zorder=3))


def _order(phase: str) -> int:
    return PHASES.index(phase) if phase in PHASES else len(PHASES)
