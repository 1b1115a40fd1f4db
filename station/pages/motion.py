"""A block's slide as a moving drawing of the plate from above: no script, and the whole way is there on paper, too."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

from station.pages.caption import Caption
from station.pages.figure import figure

Array = NDArray[np.float64]
_KEYS, _EVEN = 40, 8
"""Poses of a block that the drawing holds, at even steps of its way and of time; between them it moves evenly."""
_PAUSE = 0.15
"""The share of the time for which it stands still at the end."""
_MARGIN = 1.3
"""The width of the picture over the widest way, block included."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Moving:
    """One block: `time_s` (n,) from the drawing's beginning, `pose` (n, 3) x, y (m) and yaw (rad) on the plate."""

    name: str
    colour: str
    time_s: Array
    pose: Array
    filled: bool = False


def moving_figure(
    blocks: Sequence[Moving], *, size_m: tuple[float, float], lasts_s: float, shown_s: float, caption: Caption
) -> str:
    """Returns the drawing with its caption as HTML.

    Args:
        blocks: what moves; the first lies under the others.
        size_m: length and width of the block, m.
        lasts_s: the time that the drawing covers, s.
        shown_s: the time in which it is shown, s, again and again.
        caption: what stands below it.
    """
    ways = np.concatenate([block.pose[:, :2] for block in blocks])
    low, high = ways.min(axis=0) - max(size_m), ways.max(axis=0) + max(size_m)
    middle, reach = 1e3 * (low + high) / 2, 1e3 * _MARGIN * float((high - low).max()) / 2
    box = f"{middle[0] - reach:.2f} {-middle[1] - reach:.2f} {2 * reach:.2f} {2 * reach:.2f}"
    drawn = [_drawn(block, size_m=size_m, lasts_s=lasts_s, shown_s=shown_s) for block in blocks]
    names = " ".join(
        f'<text x="{middle[0] - 0.95 * reach:.2f}" y="{-middle[1] - (0.88 - 0.09 * row) * reach:.2f}" '
        f'font-size="{0.07 * reach:.2f}" fill="{block.colour}">{escape(block.name)}</text>'
        for row, block in enumerate(blocks)
    )
    svg = (
        f'<svg role="img" aria-label="{escape(caption.shows)}" viewBox="{box}" width="420" height="420" '
        f'style="max-width:100%" font-family="sans-serif">{"".join(drawn)}{names}{_scale(middle, reach)}</svg>'
    )
    return figure(svg, caption)


def _scale(middle: Array, reach: float) -> str:
    """Gives a bar of a round length at the lower left of a picture, given its `middle` (2,) and half its width, mm."""
    room = 0.5 * reach
    ten = 10.0 ** math.floor(math.log10(room))
    length = max(one * ten for one in (1, 2, 5) if one * ten <= room)
    left, low = middle[0] - 0.95 * reach, -middle[1] + 0.93 * reach
    return (
        f'<path d="M {left:.2f} {low:.2f} h {length:g}" stroke="#000" stroke-width="{0.015 * reach:.3f}"/>'
        f'<text x="{left:.2f}" y="{low - 0.03 * reach:.2f}" font-size="{0.07 * reach:.2f}">{length:g} mm</text>'
    )


def _drawn(block: Moving, *, size_m: tuple[float, float], lasts_s: float, shown_s: float) -> str:
    at = _moments(block, lasts_s)
    keys = [*(at / lasts_s * (1.0 - _PAUSE)), 1.0]
    x, y, yaw = (np.interp([*at, lasts_s], block.time_s, column) for column in block.pose.T)
    length, width = (1e3 * side for side in size_m)
    places = [f"{1e3 * px:.3f} {-1e3 * py:.3f}" for px, py in zip(x, y, strict=True)]
    turns = [f"{-np.degrees(angle):.2f}" for angle in yaw]
    timing = (
        f'dur="{shown_s:g}s" repeatCount="indefinite" keyTimes="{";".join(f"{key:.4f}" for key in keys)}" '
        f'attributeName="transform"'
    )
    fill = f'fill="{block.colour}" fill-opacity="0.35"' if block.filled else 'fill="none"'
    line = f'stroke="{block.colour}" stroke-width="{0.04 * width:.3f}"'
    moved = f'<animateTransform type="translate" values="{";".join(places)}" {timing}/>'
    turned = f'<animateTransform type="rotate" values="{";".join(turns)}" {timing}/>'
    return (
        f'<polyline points="{" ".join(place.replace(" ", ",") for place in places)}" fill="none" '
        f'{line} stroke-dasharray="{0.12 * width:.2f}"/>'
        f'<g transform="translate({places[-1]})">{moved}<g transform="rotate({turns[-1]})">{turned}'
        f'<rect x="{-length / 2:.3f}" y="{-width / 2:.3f}" width="{length:.3f}" height="{width:.3f}" {fill} {line}/>'
        "</g></g>"
    )


def _moments(block: Moving, lasts_s: float) -> Array:
    """Returns moments (n,), s, from 0 to the end, at which the drawing has the block's pose.

    Most of them are while it moves.
    """
    inside = (block.time_s >= 0.0) & (block.time_s <= lasts_s)
    time_s, place = block.time_s[inside], block.pose[inside, :2]
    even = np.linspace(0.0, lasts_s, _EVEN)
    if len(time_s) < 2:
        return even
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(place, axis=0).T))])
    if way[-1] <= 0.0:
        return even
    return np.unique(np.concatenate([even, np.interp(np.linspace(0.0, way[-1], _KEYS), way, time_s)]))
