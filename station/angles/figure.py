"""Fig. 3 of the paper: the difference of every source from the reference, per angle."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from shared.errors import UserError
from station.angles.compare import Comparison, SourceFit
from station.pages.caption import Caption
from station.pages.drawing import COLOURS, new_figure, style
from station.pages.figure import drawn, write

_MARKERS = {1: "^", -1: "v", 0: "o"}
_WAYS = {1: "way up", -1: "way down", 0: "first stop"}
_SPREAD = 0.16
"""Sources are drawn beside each other at each angle, over this share of the step between two angles on either side."""


def write_figure(comparison: Comparison, path: Path) -> None:
    """Writes the figure with its caption; the suffix says the kind (png, svg, pdf).

    Raises:
        UserError: if the kind is unknown or the file cannot be written.
    """
    try:
        with style():
            write(_drawn(comparison), path, _caption(comparison))
    except (OSError, ValueError) as error:
        raise UserError(f"Expected to write the figure to {path} as png, svg or pdf, but: {error}") from error


def shown(comparison: Comparison) -> str:
    """Returns the figure with its caption, for a page."""
    alt = "difference of every sensor from the reference, by angle"
    with style():
        return drawn(_drawn(comparison), _caption(comparison), name="angles", alt=alt)


def counted(comparison: Comparison) -> str:
    """Says in words on what the comparison rests."""
    return f"{sum(fit.readings for fit in comparison.fits)} readings at {comparison.stops} stops of the plate"


def _caption(comparison: Comparison) -> Caption:
    return Caption(
        shows="Fig. 3: the difference of every source from the reference at each angle, the mean of a stop. Triangles "
        "point the way in which the plate was moved; lines are the fitted offset and gain.",
        count=counted(comparison),
        interval="bars: ± 1 standard deviation",
    )


def _drawn(comparison: Comparison) -> Any:
    figure = new_figure(height_in=5.5)
    axes = figure.add_subplot()
    for index, fit in enumerate(comparison.fits):
        _draw_source(axes, comparison, fit, index)
    axes.axhline(0.0, color="0.6", linewidth=0.8, zorder=0)
    axes.set_xlabel(f"commanded angle (degrees; reference: {comparison.reference})")
    axes.set_ylabel("measured − reference (degrees)")
    axes.set_title("Mean and standard deviation per angle; lines: fitted offset and gain")
    figure.legend(loc="outside lower center", ncols=max(1, len(comparison.fits)))
    return figure


def _draw_source(axes: Any, comparison: Comparison, fit: SourceFit, index: int) -> None:
    colour = COLOURS[index % len(COLOURS)]
    angles = sorted({math.degrees(point.angle_rad) for point in comparison.points})
    step = (angles[-1] - angles[0]) / (len(angles) - 1) if len(angles) > 1 else 1.0
    beside = step * _SPREAD * (2 * (index + 0.5) / len(comparison.fits) - 1)
    for approach, marker in _MARKERS.items():
        points = [p for p in comparison.points if p.source == fit.source and p.approach == approach]
        if points:
            axes.errorbar(
                [math.degrees(point.angle_rad) + beside for point in points],
                [math.degrees(point.difference_rad) for point in points],
                yerr=[math.degrees(point.sd_rad) for point in points],
                fmt=marker, color=colour, markersize=4, elinewidth=0.7, alpha=0.8,
                label=f"{fit.source}, {_WAYS[approach]}" if approach else None,
            )  # fmt: skip
    if fit.offset is not None and fit.gain is not None:
        offset, slope = math.degrees(fit.offset.value), fit.gain.value - 1
        axes.plot(angles, [offset + slope * angle for angle in angles], color=colour, linewidth=1.0)
