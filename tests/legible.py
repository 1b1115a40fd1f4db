"""Texts of a figure that nobody can read: cut at its edge, or lying over one another or on a line."""

from __future__ import annotations

from itertools import combinations
from typing import Any
from unittest.mock import patch

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text
from matplotlib.transforms import Bbox

_DPI, _SLACK_PX = 100.0, 1.0
"""The box of a text is larger than its letters: a pixel of it is none of them."""


def illegible(figure: Any) -> list[str]:
    """Returns a line for each text of a figure that is cut at the figure's edge or lies over another text or a line."""
    figure.set_dpi(_DPI)
    canvas = FigureCanvasAgg(figure)
    texts = _drawn(canvas)
    boxes = [(text, text.get_window_extent(canvas.get_renderer())) for text in texts]
    width, height = canvas.get_width_height()
    cut = [f"cut: {text.get_text()}" for text, box in boxes if not _inside(box, width, height)]
    upright = [(text.get_text(), box) for text, box in boxes if text.get_rotation() % 90 == 0]
    over = [f"over: {one} | {other}" for (one, a), (other, b) in combinations(upright, 2) if _share(a, b)]
    bare = [
        (text.get_text(), box) for text, box in boxes if text.get_rotation() % 90 == 0 and not text.get_bbox_patch()
    ]
    on = [f"on a line: {text}" for text, box in bare if any(_lies_on_a_line(box, axes) for axes in figure.axes)]
    return cut + over + on


def _lies_on_a_line(box: Bbox, axes: Any) -> bool:
    """Returns whether a line between points of a panel goes through a box; its grid is none of them."""
    inner = Bbox.intersection(box.padded(-_SLACK_PX), axes.bbox)
    lines = [line for line in axes.lines if line.get_visible() and line.get_linestyle() != "None"]
    curves = [line.get_transform().transform_path(line.get_path()) for line in lines]
    return inner is not None and any(curve.intersects_bbox(inner, filled=False) for curve in curves)


def _drawn(canvas: FigureCanvasAgg) -> list[Text]:
    found, draw = list[Text](), Text.draw

    def noted(text: Text, renderer: Any) -> None:
        if text.get_visible() and text.get_text().strip():
            found.append(text)
        draw(text, renderer)

    with patch.object(Text, "draw", noted):
        canvas.draw()
    return found


def _inside(box: Bbox, width: float, height: float) -> bool:
    return min(box.x0, box.y0, width - box.x1, height - box.y1) >= -_SLACK_PX


def _share(one: Bbox, other: Bbox) -> bool:
    across = min(one.x1, other.x1) - max(one.x0, other.x0)
    up = min(one.y1, other.y1) - max(one.y0, other.y0)
    return min(across, up) > _SLACK_PX
