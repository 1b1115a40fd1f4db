"""A session at one moment, as terminals and scripts are told of it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Health:
    """The health of one part: `text` says it in a few words, `well` is False where somebody should look."""

    part: str
    well: bool
    text: str
    off: bool = False
    """True where nothing can be said, and nothing is wrong."""


@dataclass(frozen=True, kw_only=True)
class Direction:
    """The kept samples of one direction (−1: free azimuths), and mean and standard deviation of their onsets.

    `azimuth_deg` is that of the tilting axis; None where it is free.
    """

    direction: int
    count: int
    mean_deg: float | None
    sd_deg: float | None
    azimuth_deg: float | None = None


@dataclass(frozen=True, kw_only=True)
class Moment:
    """A session at one moment.

    `moved_px` is how far the corner that decides has moved from its reference, `threshold_px` how far it may: the slip
    rule asks for a number of corners, and this is the last of them. Both are None where there is no reference. In mm
    they are known where the camera's geometry is. `azimuth_deg` is that of the tilting axis, while it has a direction.
    `left_s` is None before the first sample.
    """

    run: int
    phase: str
    direction: int | None
    tilt_deg: float | None
    moved_px: float | None
    threshold_px: float | None
    done: int
    total: int
    passed_s: float
    left_s: float | None
    by_direction: tuple[Direction, ...]
    health: tuple[Health, ...]
    lines: tuple[str, ...]
    paused: bool = False
    """True while no further run begins."""
    moved_mm: float | None = None
    threshold_mm: float | None = None
    azimuth_deg: float | None = None
