"""The map of residuals on the plate, before and after."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.patches import Circle

from station.diagnosis.report import scales
from station.diagnosis.report.picture_data import ChannelPicture, PictureData
from station.pages.drawing import MOST_DOTS, new_figure
from station.physics.contact import Array

_CHANNELS = ("onset", "along")
_NEAR = 0.6
"""Share of the opening's radius: if blocks came beyond it, the map shows the opening's edge."""


def channels_on_plate(pictures: PictureData) -> tuple[ChannelPicture, ...]:
    """Returns the onset and slide channels whose places are known and vary."""
    found = (pictures.channel(name) for name in _CHANNELS)
    return tuple(one for one in found if one is not None and np.isfinite(one.x_m).sum() > 1 and _spread(one) > 0)


def plate_map(pictures: PictureData, *, after: bool) -> Any:
    """Returns one row for each of `channels_on_plate`; if `after`, a second column is of the found model."""
    shown = channels_on_plate(pictures)
    columns = 2 if after else 1
    figure = new_figure(width_in=4.4 * columns, height_in=3.6 * len(shown), equal_scales=True)
    for row, channel in enumerate(shown):
        parts = [("before", channel.before), ("after", channel.after)][:columns]
        limit = _limit(channel)
        for column, (word, values) in enumerate(parts):
            axes = figure.add_subplot(len(shown), columns, row * columns + column + 1)
            _draw(figure, axes, channel, values, limit=limit, title=f"{scales.channel(channel.name)}, {word}")
            _opening(axes, pictures.opening_radius_m, reach_m=_reach(channel))
    return figure


def _draw(figure: Any, axes: Any, channel: ChannelPicture, values: Array, *, limit: float, title: str) -> None:
    factor, unit = scales.residual(channel.unit)
    known = ~channel.limit & np.isfinite(values)
    dots = axes.scatter(
        1e3 * channel.x_m[known],
        1e3 * channel.y_m[known],
        c=factor * (values[known] - np.median(values[known])),
        cmap="RdBu_r",
        vmin=-limit,
        vmax=limit,
        s=14 if known.sum() < MOST_DOTS else 5,
        edgecolors="0.4",
        linewidths=0.2,
        rasterized=bool(known.sum() > MOST_DOTS),
    )
    figure.colorbar(dots, ax=axes, label=f"recorded − simulated ({unit})", shrink=0.85)
    axes.set_aspect("equal")
    axes.set_title(title, loc="left")
    axes.set_xlabel("x on the plate (mm)")
    axes.set_ylabel("y (mm)")


def _opening(axes: Any, radius_m: float, *, reach_m: float) -> None:
    """Draws the foam's edge; where no block came near it the map is limited to the part that the blocks reached."""
    if np.isfinite(radius_m):
        axes.add_patch(Circle((0.0, 0.0), 1e3 * radius_m, fill=False, ls=":", color="0.6"))
        shown_mm = 1e3 * (radius_m if reach_m > _NEAR * radius_m else 1.1 * reach_m)
        axes.set_xlim(-shown_mm, shown_mm)
        axes.set_ylim(-shown_mm, shown_mm)


def _reach(channel: ChannelPicture) -> float:
    """Returns the largest distance of a row from the plate's centre, m."""
    return float(np.nanmax(np.hypot(channel.x_m, channel.y_m)))


def _limit(channel: ChannelPicture) -> float:
    """Returns the end of the colour scale: the 90 % quantile of the residuals' sizes."""
    factor, _ = scales.residual(channel.unit)
    known = channel.before[~channel.limit & np.isfinite(channel.before)]
    return max(float(np.quantile(np.abs(factor * (known - np.median(known))), 0.9)), 1e-9) if len(known) else 1.0


def _spread(channel: ChannelPicture) -> float:
    return float(np.nanmax([np.ptp(channel.x_m), np.ptp(channel.y_m)]))
