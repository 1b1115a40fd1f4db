"""The figure of the onsets' errors on held-out runs: their size, their distribution, and the predicted spread."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.stats import binom, norm

from station.diagnosis.predict.held_out import HeldOut
from station.pages.drawing import AFTER, BEFORE, new_figure
from station.physics.contact import Array

_BINS = 10


def onsets(before: HeldOut, after: HeldOut, *, both: bool, counted: str) -> Any:
    """Draws the errors' histogram, quantiles against a Gaussian's, and the ranks, which should be uniform.

    `counted` is what was predicted: runs, or a table's rows.
    """
    figure = new_figure(height_in=2.8)
    shown = [("before", before, BEFORE)] + ([("after", after, AFTER)] if both else [])
    errors, quantiles, ranks = (figure.add_subplot(1, 3, number) for number in (1, 2, 3))
    known = np.concatenate([_known(held.onset_error_deg) for _, held, _ in shown])
    edges = np.histogram_bin_edges(known, bins=min(24, max(8, len(known) // 12)))
    for word, held, colour in shown:
        errors.hist(
            _known(held.onset_error_deg), bins=edges, histtype="stepfilled", alpha=0.45, color=colour, label=word
        )
        _quantiles(quantiles, held.rank, colour)
        _ranks(ranks, held.rank, colour)
    errors.set_xlabel("onset: recorded − predicted (°)")
    errors.set_ylabel(counted)
    errors.legend()
    quantiles.axline((0.0, 0.0), slope=1.0, color="0.6", lw=0.8)
    quantiles.set_xlabel("expected (predicted spreads)")
    quantiles.set_ylabel("recorded")
    ranks.set_xlabel("rank in the predicted distribution")
    ranks.set_ylabel(f"{counted}, observed / expected")
    _band(ranks, int(np.isfinite(before.rank).sum()))
    return figure


def _known(values: Array) -> Array:
    return values[np.isfinite(values)]


def _quantiles(axes: Any, rank: Array, colour: str) -> None:
    known = np.sort(_known(rank))
    expected = norm.ppf((np.arange(len(known)) + 0.5) / max(len(known), 1))
    axes.plot(expected, norm.ppf(np.clip(known, 1e-6, 1 - 1e-6)), ".", ms=3, color=colour, rasterized=True)


def _ranks(axes: Any, rank: Array, colour: str) -> None:
    known = _known(rank)
    counts, edges = np.histogram(known, bins=_BINS, range=(0.0, 1.0))
    axes.stairs(counts * _BINS / max(len(known), 1), edges, color=colour, lw=1.6)


def _band(axes: Any, count: int) -> None:
    """Draws the range that nine in ten bins stay within if the predicted spread is right."""
    low, high = binom.ppf([0.05, 0.95], max(count, 1), 1 / _BINS) * _BINS / max(count, 1)
    axes.axhspan(low, high, color="0.9", zorder=0)
    axes.axhline(1.0, color="0.6", lw=0.8)
    axes.set_ylim(bottom=0.0)
