"""Turns the numbers of a polar panel's radius to where they can be read: on no line, and on the fewest dots."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.path import Path
from matplotlib.transforms import Bbox

from shared.geometry import Array

_USUAL_DEG, _STEP_DEG = 22.5, 15.0
"""The direction that matplotlib gives the numbers, and the step to others: none of them is a spoke of the panel. A
number's lower left corner is on its ring: it lies outside the ring at the upper right, and inside at the lower left. A
curve that follows a ring leaves one of them free."""


def turn_radius_numbers(axes: Any) -> None:
    """Turns the numbers of a polar panel; the usual direction stays where it is as good as any other."""
    lines, dots = list(_lines(axes)), np.concatenate([np.empty((0, 2)), *_dots(axes)])
    costs: dict[float, tuple[int, int]] = {}
    for away_deg in sorted(np.arange(-180.0, 180.0, _STEP_DEG).tolist(), key=abs):
        axes.set_rlabel_position(_USUAL_DEG + away_deg)
        boxes = [text.get_window_extent() for text in axes.yaxis.get_ticklabels() if text.get_text()]
        crossed = sum(line.intersects_bbox(box, filled=False) for box in boxes for line in lines)
        costs[away_deg] = crossed, sum(_count(dots, box) for box in boxes)
    axes.set_rlabel_position(_USUAL_DEG + min(costs, key=costs.__getitem__))


def _lines(axes: Any) -> Iterator[Path]:
    """Yields the lines of a panel, in pixels."""
    for line in axes.lines:
        if line.get_linestyle() != "None":
            yield line.get_transform().transform_path(line.get_path())


def _dots(axes: Any) -> Iterator[Array]:
    """Yields the places (n, 2) of a panel's markers and dots, in pixels."""
    for line in axes.lines:
        if line.get_linestyle() == "None":
            yield line.get_transform().transform(line.get_xydata())
    for dots in axes.collections:
        yield dots.get_offset_transform().transform(np.ma.filled(dots.get_offsets(), np.nan))


def _count(dots: Array, box: Bbox) -> int:
    """Counts the dots (n, 2) in a box; px."""
    return int(((dots > box.min) & (dots < box.max)).all(axis=1).sum())
