"""The paper's four filters (section IV) and its Table III. They flag; nothing is ever deleted.

Distance: the corners moved less than 20 px on average. Angle: theta differs by more than three standard deviations
from the mean. Circumference: the mark's, before or after, differs by more than three standard deviations from the mean
of all. Border: the block slid along the foam (`grazes`). Each is judged on all the slides of a surface pair, whatever
the others say, so that their numbers add up to the paper's "total". Runs without a slide are kept apart: no filter
looks at them and no mean counts them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from station.friction.direction import Array
from station.friction.slides import Bools, Slides
from station.rig import opening as foam

DISTANCE_PX = 20.0
SIGMAS = 3.0
CUTOUT_M = 0.045
"""Radius of the round opening in the foam: the paper gives none; a plate of 0.1 m leaves 5 mm of foam at the sides."""
GRAZE_RAD = math.radians(30.0)
"""The paper says only "pre- and post-sliding positions". A block that starts at the foam and goes straight across, or
ends there after doing so, was not hindered; one whose slide runs within this angle of the foam's tangent, at an end
where it touches, or into the foam, slid along it. On a circle that is a chord below 60° of arc."""
ROUNDING = 1e-9
"""Relative difference that is never outlying: values that are equal but for rounding have a tiny spread."""
FILTERS = ("distance", "angle", "circumference", "border")


@dataclass(frozen=True, slots=True)
class Opening:
    """The round opening in the foam, in the plate frame."""

    radius_m: float = CUTOUT_M
    x_m: float = 0.0
    y_m: float = 0.0


@dataclass(frozen=True, eq=False)
class Flags:
    """The slides (n,) that each filter flagged, and those (n,) to which it is applicable at all."""

    by_filter: Mapping[str, Bools]
    applicable: Mapping[str, Bools]
    slid: Bools

    @property
    def flagged(self) -> Bools:
        """Slides that any filter flagged (n,)."""
        return np.logical_or.reduce(list(self.by_filter.values()))

    @property
    def kept(self) -> Bools:
        """Slides that no filter flagged (n,); runs without a slide are not among them."""
        return self.slid & ~self.flagged

    def names(self, row: int) -> tuple[str, ...]:
        """Returns the filters that flagged one slide."""
        return tuple(name for name, flags in self.by_filter.items() if flags[row])


@dataclass(frozen=True, slots=True)
class FilterCounts:
    """A row of Table III; `unique` slides were flagged, `total` times. `samples`: slides judged; `censored`: others."""

    samples: int
    censored: int
    unique: int
    total: int
    by_filter: Mapping[str, int]


def filter_slides(slides: Slides, *, opening: Opening | None = None) -> Flags:
    """Applies the paper's four filters to the slides of one surface pair."""
    slid = ~slides.censored
    around = slides.circumference_px
    known = slid & np.isfinite(slides.distance_px)
    placed = slid & np.isfinite(slides.pre_m).all(axis=(1, 2)) & np.isfinite(slides.post_m).all(axis=(1, 2))
    short = known & (slides.distance_px < DISTANCE_PX)
    return Flags(
        by_filter={
            "distance": short,
            "angle": _far(slides.theta_rad, slid),
            "circumference": np.logical_or.reduce(_far(around, known[:, None] & np.isfinite(around)), axis=1),
            # Where places are unknown, an earlier analysis that knew them is believed.
            "border": (placed & grazes(slides, opening=opening or Opening())) | (slid & ~placed & slides.at_border),
        },
        applicable={"distance": known, "angle": slid, "circumference": known, "border": placed},
        slid=slid,
    )


def _far(values: Array, counted: NDArray[np.bool_]) -> Bools:
    """Returns true (n,) for values more than three standard deviations from the mean of the counted ones."""
    counted = np.broadcast_to(counted, values.shape)
    if counted.sum() < 2:
        return np.zeros(values.shape, dtype=bool)
    mean, sd = values[counted].mean(), values[counted].std(ddof=1)
    return counted & (np.abs(values - mean) > SIGMAS * sd + ROUNDING * abs(mean))


def grazes(slides: Slides, *, opening: Opening) -> Bools:
    """Marks slides that ran along the foam or into it at an end at which the block touches it (n,).

    Unknown places are not marked.
    """
    centre = np.array([opening.x_m, opening.y_m])
    before, after = slides.pre_m - centre, slides.post_m - centre
    moved = (after - before).mean(axis=1)
    length = np.linalg.norm(moved, axis=1)
    start, end = touching(before, opening.radius_m), touching(after, opening.radius_m)
    limit = math.sin(GRAZE_RAD)
    # The share of the slide that points out of the opening: −1 straight away from the foam, 1 straight into it.
    leaving = _outward(before, moved) > -limit * length
    arriving = _outward(after, moved) < limit * length
    return (start & leaving) | (end & arriving)


def _outward(corners: Array, moved: Array) -> Array:
    centre = corners.mean(axis=1)
    reach = np.maximum(np.linalg.norm(centre, axis=1), 1e-12)
    return np.sum(centre * moved, axis=1) / reach


def touching(corners: Array, radius_m: float) -> Bools:
    """Marks blocks (n,) that touch the foam or lie in it; corners (n, 4, 2) from the opening's centre."""
    return foam.Opening(radius_m=radius_m).touches(corners)


def count(flags: Flags) -> FilterCounts:
    """Returns the row of Table III."""
    by_filter = {name: int(flagged.sum()) for name, flagged in flags.by_filter.items()}
    return FilterCounts(
        samples=int(flags.slid.sum()),
        censored=int((~flags.slid).sum()),
        unique=int(flags.flagged.sum()),
        total=sum(by_filter.values()),
        by_filter=by_filter,
    )
