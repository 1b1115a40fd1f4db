"""A pair's runs as the likelihood takes them: what was pulled which way, when it started, and where it went.

A run's covariates are known before it can slide: the direction of tilting, the block's yaw, the range of angles. All
of them follow from earlier runs and from chance, so the likelihood is that of each run given its covariates. What a
run itself decides is modelled: its onset, even if only "more than what the arm reached", and where it slid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from shared.messages import Sample
from station.friction.direction import Array
from station.friction.filters import Opening
from station.friction.pairs import Pair
from station.friction.slides import Bools, Slides
from station.rig import opening as foam

LEFT_OUT = ("distance", "circumference", "border")
"""Filters that say that a run's measurement is wrong. The angle filter is not among them: to leave out runs because
their friction was high is to bias it, and Student's tails bear with the others."""
_CORNER_PX = 0.3
"""Standard deviation of a corner where the sample does not say: the paper's tracker."""
_GRAVITY_M_S2 = 9.81
_LATE_M = 2.5e-3
"""The way that a block has gone when the paper's rule sees it, where the sample does not say: some 14 pixels."""
_LEAST_TILT_RAD = 1e-4


@dataclass(frozen=True, eq=False, kw_only=True)
class Observations:
    """One row a run (n,). Pulls are ln tan of the tilt.

    `pull` is the one at the onset, with `pull_sigma`; where the onset is only known to lie between two tilts it is NaN
    and `above` and `below` are their pulls (−inf and +inf where there is none: a censored run has `below` = +inf).
    Runs that slid below the pull `seen_from` would not be in the data at all (−inf: all are). `towards_object_rad` and
    `towards_plate_rad` are downhill against the object and the plate, `slide_rad` is the slide against the object (NaN
    for none) with its measurement error `slide_sigma_rad`. `place` is the run's place in the session, −1 to 1.
    """

    pull: Array
    pull_sigma: Array
    above: Array
    below: Array
    seen_from: Array
    towards_object_rad: Array
    towards_plate_rad: Array
    slide_rad: Array
    slide_sigma_rad: Array
    place: Array

    def __len__(self) -> int:
        return len(self.pull)

    @property
    def resolved(self) -> Bools:
        """Runs whose onset is known (n,)."""
        return np.isfinite(self.pull)

    @property
    def censored(self) -> Bools:
        """Runs of which only is known that it takes more (n,)."""
        return ~self.resolved & np.isposinf(self.below)

    @property
    def orientation_rad(self) -> Array:
        """The object's yaw against the plate (n,)."""
        return self.towards_plate_rad - self.towards_object_rad

    def where(self, chosen: Bools | NDArray[np.intp]) -> Observations:
        """Returns the rows that are chosen (n,)."""
        return Observations(**{spec.name: getattr(self, spec.name)[chosen] for spec in fields(self)})


def observations_of(pair: Pair) -> Observations:
    """Returns the runs of a pair whose block was seen, but for those that `LEFT_OUT` flagged or the foam held."""
    every = _every(pair)
    return every.where(~np.logical_or.reduce(list(_out(pair, every).values())))


def uncounted(pair: Pair) -> dict[str, int]:
    """Returns the number of a pair's runs that are not `resolved`, or left out, by the reason."""
    every = _every(pair)
    unknown = {"without a slip": every.censored, "with an onset known only to its step": ~every.resolved}
    left, counts = np.ones(len(every), dtype=np.bool_), dict[str, int]()
    for why, runs in (_out(pair, every) | unknown).items():
        counts[why] = int((left & runs).sum())
        left &= ~runs
    return {why: count for why, count in counts.items() if count}


def _out(pair: Pair, every: Observations) -> dict[str, Bools]:
    """Returns the runs (n,) that tell nothing of the curve by the reason."""
    return {
        "leaning on the foam": _leaning(pair.slides, pair.opening),
        "flagged by a filter": np.logical_or.reduce([pair.flags.by_filter[name] for name in LEFT_OUT]),
        "without a direction": ~(np.isfinite(every.orientation_rad) & np.isfinite(every.slide_sigma_rad)),
    }


def _every(pair: Pair) -> Observations:
    """Returns all runs of a pair."""
    slides, samples = pair.slides, pair.samples
    mount = _column(samples, "plate_mount_rad")
    # The yaw is known where the slide is not: a censored run has none.
    yaw = np.where(np.isfinite(slides.orientation_rad), slides.orientation_rad + mount, np.nan)
    downhill = slides.azimuth_rad - math.pi / 2
    low, high = _bracket(slides, samples)
    bracketed = ~slides.censored & slides.unresolved & (high > low)
    known = ~slides.censored & ~bracketed
    tilt = np.maximum(slides.tilt_rad, _LEAST_TILT_RAD)
    sigma = np.nan_to_num(_column(samples, "onset_sigma_rad"))
    count = len(slides)
    return Observations(
        pull=np.where(known, _pull(tilt), np.nan),
        # d ln tan = d theta (1 + tan²) / tan.
        pull_sigma=2.0 * sigma / np.sin(2.0 * tilt),
        above=np.where(slides.censored, _pull(tilt), np.where(bracketed, _pull(low), np.nan)),
        below=np.where(slides.censored, np.inf, np.where(bracketed, _pull(high), np.nan)),
        seen_from=np.full(count, -np.inf),
        towards_object_rad=downhill - yaw,
        towards_plate_rad=downhill - mount,
        slide_rad=np.where(slides.censored, np.nan, slides.slide_rad - yaw),
        slide_sigma_rad=_slide_sigma_rad(slides, samples),
        place=np.linspace(-1.0, 1.0, count) if count > 1 else np.zeros(count),
    )


def _column(samples: tuple[Sample, ...], name: str) -> Array:
    return np.array([float(getattr(sample, name)) for sample in samples])


def _leaning(slides: Slides, opening: Opening) -> Bools:
    """Marks blocks (n,) that touched foam which did not let them go: it held them, or turned them aside.

    By the direction of the pull, which is known beforehand, and not by what the block then did.
    """
    centre = np.array([opening.x_m, opening.y_m])
    before = slides.pre_m - centre
    downhill = np.column_stack([np.sin(slides.azimuth_rad), -np.cos(slides.azimuth_rad)])
    way_m = foam.Opening(radius_m=opening.radius_m).way_m(before, downhill)
    return np.isfinite(before).all(axis=(1, 2)) & (way_m <= 0.0)


def _pull(tilt_rad: Array) -> Array:
    with np.errstate(divide="ignore"):
        return np.log(np.tan(np.clip(tilt_rad, 0.0, math.radians(89.9))))


def _bracket(slides: Slides, samples: tuple[Sample, ...]) -> tuple[Array, Array]:
    """Returns the tilts (n, n) between which an onset lies that could not be fitted.

    It was noticed by the paper's rule, which is late: at a tilt rate w a block that starts goes d in (6 d cos θ w² /
    g)^(1/3) of tilt, and may have started that much before the step in which it was noticed.
    """
    rate = np.nan_to_num(_column(samples, "tilt_rate_rad_s"))
    late = np.cbrt(6 * _LATE_M * np.cos(slides.tilt_rad) * rate**2 / _GRAVITY_M_S2)
    low = np.minimum(_column(samples, "step_from_rad"), slides.tilt_rad)
    high = np.maximum(_column(samples, "step_to_rad"), slides.tilt_rad)
    given = _column(samples, "step_to_rad") > 0
    return np.where(given, np.maximum(low - late, 0.0), np.nan), np.where(given, high, np.nan)


def _slide_sigma_rad(slides: Slides, samples: tuple[Sample, ...]) -> Array:
    """Returns the error of a slide's direction against the block (n,), from the corners' noise.

    The noise acts on both centres and on the yaw.
    """
    corner = np.array([_corner_px(sample) for sample in samples])
    side = slides.circumference_px[:, 0] / 4
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.where(slides.censored, np.inf, np.maximum(slides.distance_px, 1.0))
        # A centre has half of a corner's error, and there are two; the yaw's is the corner's over side times root two.
        return np.sqrt(0.5 * (corner / along) ** 2 + 0.5 * (corner / side) ** 2)


def _corner_px(sample: Sample) -> float:
    variance = sample.corner_variance_px2
    return math.sqrt(sum(variance) / len(variance)) if variance and sum(variance) > 0 else _CORNER_PX
