"""The located places as curves: the residual's mean over the covariate, with 90 % intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from textwrap import fill
from typing import Any

import numpy as np

from station.diagnosis.report import scales
from station.diagnosis.report.html import p_value
from station.diagnosis.report.picture_data import PictureData
from station.diagnosis.result import Located
from station.pages.drawing import MARKED, new_figure

MOST = 6
_Z90 = 1.645
_LETTERS = 32
"""Letters of a line under a panel, which is two inches wide: the layout makes no room for a label beyond its panel."""


def drawable(places: Sequence[Located]) -> tuple[Located, ...]:
    """Returns the first MOST places that have a curve."""
    return tuple(place for place in places if len(place.curve) > 1)[:MOST]


def curves(places: Sequence[Located], pictures: PictureData) -> Any:
    """Returns the figure with one panel for each of the `drawable` places."""
    across = min(3, len(places))
    down = math.ceil(len(places) / across)
    figure = new_figure(width_in=3.1 * across + 0.2, height_in=2.6 * down)
    for number, place in enumerate(places):
        channel = pictures.channel(place.channel)
        unit = channel.unit if channel is not None else ""
        _draw(figure.add_subplot(down, across, number + 1), place, unit=unit)
    return figure


def _draw(axes: Any, place: Located, *, unit: str) -> None:
    points = np.array(place.curve)
    factor, shown = scales.residual(unit)
    x, label = scales.covariate(place.covariate, points[:, 0])
    axes.axhline(0.0, color="0.75", lw=0.8)
    axes.errorbar(
        x, factor * points[:, 1], yerr=_Z90 * factor * points[:, 2], fmt="o-", ms=3.5, lw=1, color=MARKED, capsize=2
    )
    title = fill(f"{place.phase}: {scales.channel(place.channel)}", _LETTERS)
    axes.set_title(f"{title}\np {p_value(place.p)}", loc="left", fontsize=8.5)
    axes.set_xlabel(fill(label, _LETTERS))
    axes.set_ylabel(f"recorded − simulated\n({shown})", fontsize=8)
