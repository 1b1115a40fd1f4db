"""The figure of before, after and floor on held-out runs, each with its 90 % interval."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from station.diagnosis.predict.held_out import HeldOut
from station.diagnosis.report.picture_data import PictureData
from station.diagnosis.result import Diagnosis
from station.pages.drawing import AFTER, BEFORE, FLOOR, new_figure
from station.physics.contact import Array

_Z90 = 1.645
_NOMINAL = 0.9
Bar = tuple[str, float, float, float, str]
"""Name, value, lower and upper end of the 90 % interval, and colour."""


def scores(diagnosis: Diagnosis, pictures: PictureData) -> Any:
    """Returns three dot plots: onset error, path error, and the share of onsets within their 90 % intervals."""
    figure = new_figure(height_in=2.2)
    before, after = pictures.held_before, pictures.held_after
    onset, path, held = (figure.add_subplot(1, 3, number) for number in (1, 2, 3))
    _dots(onset, _bars(before, after, "onset_error_deg"), "onset error, root mean square (°)")
    floor = diagnosis.fit.floor_onset_deg
    if math.isfinite(floor):
        onset.axvline(floor, color=FLOOR, ls="--", lw=1)
        onset.annotate(
            "floor", (floor, 1.0), xycoords=onset.get_xaxis_transform(), xytext=(4, 0), textcoords="offset points",
            va="top", fontsize=8, color=FLOOR,
        )  # fmt: skip
    _dots(path, _bars(before, after, "path_error_mm"), "path error, root mean square (mm)")
    coverage = _coverage(before, after)
    _dots(held, coverage, "onsets within their 90 % interval")
    if any(math.isfinite(bar[1]) for bar in coverage):
        held.axvline(_NOMINAL, color=FLOOR, ls="--", lw=1)
    return figure


def root_mean_square(values: Array) -> tuple[float, float, float]:
    """Returns the root mean square of errors with its 90 % interval (delta method); nan below two known errors.

    The errors `values` (n,) keep their unit.
    """
    known = values[np.isfinite(values)] ** 2
    if len(known) < 2:
        return math.nan, math.nan, math.nan
    middle = math.sqrt(float(known.mean()))
    error = float(np.std(known, ddof=1)) / math.sqrt(len(known)) / max(2 * middle, 1e-12)
    return middle, max(middle - _Z90 * error, 0.0), middle + _Z90 * error


def wilson(hits: int, count: int) -> tuple[float, float, float]:
    """Returns the share of hits with its 90 % interval (Wilson 1927); nan for a count of 0."""
    if count == 0:
        return math.nan, math.nan, math.nan
    share, z2 = hits / count, _Z90**2
    middle = (share + z2 / (2 * count)) / (1 + z2 / count)
    half = _Z90 * math.sqrt(share * (1 - share) / count + z2 / (4 * count**2)) / (1 + z2 / count)
    # By rounding alone the ends of 0 and of 1 may be on the wrong side of them.
    return share, min(max(middle - half, 0.0), share), max(min(middle + half, 1.0), share)


def _bars(before: HeldOut | None, after: HeldOut | None, name: str) -> list[Bar]:
    both = (("before", before, BEFORE), ("after", after, AFTER))
    return [(word, *root_mean_square(getattr(held, name)), colour) for word, held, colour in both if held is not None]


def _coverage(before: HeldOut | None, after: HeldOut | None) -> list[Bar]:
    bars: list[Bar] = []
    for word, held, colour in (("before", before, BEFORE), ("after", after, AFTER)):
        if held is not None:
            rank = held.rank[np.isfinite(held.rank)]
            hits = int(np.sum(np.abs(rank - 0.5) <= 0.5 * _NOMINAL))
            bars.append((word, *wilson(hits, len(rank)), colour))
    return bars


def _dots(axes: Any, bars: list[Bar], label: str) -> None:
    known = [bar for bar in bars if math.isfinite(bar[1])]
    axes.set_xlabel(label)
    axes.set_yticks(range(len(known)), [bar[0] for bar in known])
    axes.set_ylim(len(known) - 0.4, -0.6)
    if not known:
        axes.text(0.5, 0.5, "not in this recording", ha="center", transform=axes.transAxes, color="0.5")
        axes.set_xticks([])
        return
    for row, (_, value, low, high, colour) in enumerate(known):
        axes.errorbar([value], [row], xerr=[[value - low], [high - value]], fmt="o", ms=6, color=colour, capsize=3)
        plain = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
        axes.text(value, row - 0.16, f"{value:.3g}", ha="center", va="bottom", fontsize=8, color=colour, bbox=plain)
    axes.margins(x=0.15)
