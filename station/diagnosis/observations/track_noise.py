"""The noise of a track's frames: as reported, or from the moving block's own path."""

from __future__ import annotations

import numpy as np

from station.diagnosis.observations.plate import Times
from station.physics.contact import Array, Bools
from station.signals.tracks import CornerTrack

STRIDE = 3
"""Frames between those that are compared. A tracker that smooths leaves errors that last for frames, and what counts is
how far they bend a window of nine."""

LEAST_PLACES = 50
MOVED_M = 5e-3
_THIRD = np.array([-1.0, 3.0, -3.0, 1.0])
_GAUSSIAN_MAD = 0.6745

UNKNOWN_PX = 0.05
"""The noise of a corner, px, whose frame does not report it: what the tracker has on a sharp picture."""


def corner_sigma_px(corners: CornerTrack) -> Array:
    """Returns the standard deviation (n,) of one corner in each frame, px, in x and in y."""
    known = np.isfinite(corners.sigma_px) & (corners.sigma_px > 0)
    return np.where(known, corners.sigma_px, UNKNOWN_PX)


def track_noise(time_ns: Times, values: Array, place_m: Array, flat: Bools) -> float | None:
    """Returns the standard deviation of values in one frame, from their third differences while the block slides flat.

    A steady acceleration leaves no third difference. It is None if the block slides too little.

    Args:
        time_ns: (n,) times of the frames, ns.
        values: (n,) what is measured, in any unit.
        place_m: (n, 2) the block's places, m.
        flat: (n,) True where the block lies flat.
    """
    span = STRIDE * (len(_THIRD) - 1)
    if len(values) <= span:
        return None
    first = np.arange(len(values) - span)
    grid = first[:, None] + STRIDE * np.arange(len(_THIRD))
    step = np.median(np.diff(time_ns))
    together = np.abs(time_ns[grid[:, -1]] - time_ns[first] - span * step) < 0.5 * step
    lying = np.convolve(flat, np.ones(span + 1), mode="valid") > span
    moved = np.hypot(*(place_m[grid[:, -1]] - place_m[first]).T) > MOVED_M
    chosen = grid[together & lying & moved]
    if len(chosen) < LEAST_PLACES:
        return None
    differences = values[chosen] @ _THIRD
    spread = float(np.median(np.abs(differences - np.median(differences)))) / _GAUSSIAN_MAD
    return max(spread / float(np.linalg.norm(_THIRD)), 1e-9)
