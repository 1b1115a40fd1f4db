"""The comparison of angle sources: the paper's Table I, and a model of each source's error. Pure numbers.

Readings. The window of a stop is divided into m equal parts (the paper's 50 readings); a source's reading nearest to
the middle of each part is taken, so that sources of any rate are compared at the same instants. A source with fewer
readings is held (a value typed in once counts at every instant).

Table I. For every pair, over all instants of all stops: the mean of |a − b|, and the standard deviation of a − b. That
the paper's "±" is the latter follows from its own figures: 0.16 ± 0.25 is impossible for the spread of an absolute
value around 0.16 unless nearly all of it lies in a few readings.

Model. For source s with mean reading y_i and reference r_i at stop i, and u_i = +1 on the way up, −1 on the way down:

    y_i − r_i = a + (g − 1) r_i + h u_i / 2 + e_i

a: offset at level, g: gain, h: hysteresis (reading on the way up minus reading on the way down). Least squares;
intervals from the covariance HC3 of MacKinnon and White (J. Econometrics 29, 1985), which lets e_i have a variance of
its own at each stop, and Student's t with n − p degrees of freedom. Errors of different stops are taken as
independent: a drift from stop to stop is not in the model, and would make the intervals too narrow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from shared.errors import UserError
from station.angles.stops import Series, Stop

Array = NDArray[np.float64]
COMMANDED = "commanded"
"""The reference of the paper: the angle that was asked for."""
LEVEL = 0.95
_SUSPECT = 8.0
_MAD_TO_SIGMA = 1.4826


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value and its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class Pair:
    """One cell of Table I, in radians. `bias_rad` is the mean of first − second; `count` the instants compared."""

    first: str
    second: str
    mean_abs_rad: float
    sd_rad: float
    bias_rad: float
    count: int


@dataclass(frozen=True, kw_only=True)
class SourceFit:
    """One source against the reference; None where the stops do not determine it.

    `offset` and `hysteresis` are in radians, `gain` has none. `noise_rad` is the spread within stops, `scatter_rad`
    that of the stops' means about the model. `suspect` readings lie further from their stop's median than any noise
    explains; they are counted, not left out.
    """

    source: str
    stops: int
    readings: int
    offset: Estimate | None
    gain: Estimate | None
    hysteresis: Estimate | None
    noise_rad: float
    scatter_rad: float
    suspect: int


@dataclass(frozen=True, kw_only=True)
class Point:
    """One point of Fig. 3: the difference from the reference at one angle, approached from one side, in radians."""

    source: str
    angle_rad: float
    approach: int
    difference_rad: float
    sd_rad: float
    count: int


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Everything that a comparison finds; `sources` begins with the reference."""

    reference: str
    sources: tuple[str, ...]
    stops: int
    pairs: tuple[Pair, ...]
    fits: tuple[SourceFit, ...]
    points: tuple[Point, ...]


@dataclass(frozen=True, kw_only=True)
class _Table:
    """Readings at common instants, (stops, m) for each source, NaN where there is none."""

    angles: dict[str, Array]
    approach: Array
    commanded: Array

    def mean(self, source: str) -> Array:
        values = self.angles[source]
        seen = np.isfinite(values)
        total = np.where(seen, values, 0.0).sum(axis=1)
        return np.divide(total, seen.sum(axis=1), out=np.full(len(values), np.nan), where=seen.any(axis=1))


def compare(stops: Sequence[Stop], *, reference: str = COMMANDED, readings: int = 50) -> Comparison:
    """Compares all sources that said anything; `reference` is one of them, or the commanded angle.

    Raises:
        UserError: if the reference, or every source, has no readings.
    """
    names = sorted({name for stop in stops for name, series in stop.series.items() if len(series.angle_rad)})
    if not names:
        raise UserError("Expected readings of at least one angle source at the stops, but there are none")
    if reference not in (COMMANDED, *names):
        raise UserError(f"Expected a reference of {COMMANDED}, {', '.join(names)}; got {reference!r}")
    table = _table(stops, names, readings)
    others = tuple(name for name in (COMMANDED, *names) if name != reference)
    sources = (reference, *others)
    measured = tuple(name for name in others if name != COMMANDED)
    return Comparison(
        reference=reference,
        sources=sources,
        stops=len(stops),
        pairs=tuple(_pair(table, a, b) for index, a in enumerate(sources) for b in sources[index + 1 :]),
        fits=tuple(_fit(table, stops, name, reference) for name in measured),
        points=tuple(point for name in measured for point in _points(table, name, reference)),
    )


def _table(stops: Sequence[Stop], names: Sequence[str], readings: int) -> _Table:
    commanded = np.array([stop.angle_rad for stop in stops])
    angles = {name: np.array([_at_instants(stop.series.get(name), stop, readings) for stop in stops]) for name in names}
    angles[COMMANDED] = np.repeat(commanded[:, None], readings, axis=1)
    approach = np.array([float(stop.approach) for stop in stops])
    return _Table(angles=angles, approach=approach, commanded=commanded)


def _at_instants(series: Series | None, stop: Stop, readings: int) -> Array:
    """Returns the readings (m,) nearest to the middles of the m parts of a stop's window."""
    if series is None or not len(series.angle_rad):
        return np.full(readings, np.nan)
    instants = stop.begin_ns + (np.arange(readings) + 0.5) / readings * (stop.end_ns - stop.begin_ns)
    middles = (series.stamp_ns[:-1] + series.stamp_ns[1:]) / 2
    return series.angle_rad[np.searchsorted(middles, instants)]


def _pair(table: _Table, first: str, second: str) -> Pair:
    difference = table.angles[first] - table.angles[second]
    known = difference[np.isfinite(difference)]
    count = len(known)
    return Pair(
        first=first,
        second=second,
        mean_abs_rad=float(np.mean(np.abs(known))) if count else np.nan,
        sd_rad=float(np.std(known, ddof=1)) if count > 1 else np.nan,
        bias_rad=float(np.mean(known)) if count else np.nan,
        count=count,
    )


def _fit(table: _Table, stops: Sequence[Stop], source: str, reference: str) -> SourceFit:
    series = [found for stop in stops if (found := stop.series.get(source)) and len(found.angle_rad)]
    difference, angle = table.mean(source) - table.mean(reference), table.mean(reference)
    known = np.isfinite(difference)
    estimates, scatter = regress(difference[known], angle_rad=angle[known], approach=table.approach[known])
    gain = estimates["gain"]
    return SourceFit(
        source=source,
        stops=int(known.sum()),
        readings=sum(len(one.angle_rad) for one in series),
        offset=estimates["offset"],
        gain=Estimate(1 + gain.value, 1 + gain.low, 1 + gain.high) if gain else None,
        hysteresis=estimates["hysteresis"],
        noise_rad=_noise(series),
        scatter_rad=scatter,
        suspect=_suspect(series),
    )


def regress(difference: Array, *, angle_rad: Array, approach: Array) -> tuple[dict[str, Estimate | None], float]:
    """Gives offset, gain − 1 and hysteresis of the model above from stops (n,), and the residuals' standard deviation.

    A term that the stops cannot tell apart is left out and None: gain with one angle only, hysteresis with stops on
    one way only. With too few stops all are None and the deviation is NaN.

    Args:
        difference: (n,) a source's mean reading less the reference, rad.
        angle_rad: (n,) the reference, rad.
        approach: (n,) +1 for a stop on the way up, −1 on the way down, 0 for the first.
    """
    terms = {"offset": np.ones_like(difference)}
    if len(angle_rad) and np.ptp(angle_rad) > 1e-6:
        terms["gain"] = angle_rad
    if (approach > 0).any() and (approach < 0).any():
        terms["hysteresis"] = approach / 2
    found: dict[str, Estimate | None] = dict.fromkeys(("offset", "gain", "hysteresis"))
    design = np.column_stack(list(terms.values()))
    freedom = len(difference) - len(terms)
    if freedom < 1 or np.linalg.matrix_rank(design) < len(terms):
        return found, float("nan")
    values, covariance, residuals = _least_squares(design, difference)
    half = float(stdtrit(freedom, (1 + LEVEL) / 2)) * np.sqrt(np.diag(covariance))
    for name, value, width in zip(terms, values.tolist(), half.tolist(), strict=True):
        found[name] = Estimate(value, value - width, value + width)
    return found, float(np.sqrt(residuals @ residuals / freedom))


def _least_squares(design: Array, target: Array) -> tuple[Array, Array, Array]:
    """Returns coefficients (p,), their HC3 covariance (p, p) and the residuals (n,)."""
    bread = np.linalg.inv(design.T @ design)
    values = bread @ design.T @ target
    residuals = target - design @ values
    leverage = np.einsum("ij,jk,ik->i", design, bread, design)
    scaled = design * (residuals / np.maximum(1.0 - leverage, 1e-6))[:, None]
    return values, bread @ (scaled.T @ scaled) @ bread, residuals


def _noise(series: Sequence[Series]) -> float:
    """Returns the pooled standard deviation within stops; NaN when no stop has two readings."""
    many = [one.angle_rad for one in series if len(one.angle_rad) > 1]
    freedom = sum(len(angles) - 1 for angles in many)
    total = sum(float(np.sum((angles - angles.mean()) ** 2)) for angles in many)
    return (total / freedom) ** 0.5 if freedom else float("nan")


def _suspect(series: Sequence[Series]) -> int:
    """Returns the number of readings that lie more than eight robust standard deviations from their stop's median.

    The deviation is that of all stops together, so that a quiet stop of a coarse gauge makes nothing suspect.
    """
    offs = [one.angle_rad - np.median(one.angle_rad) for one in series]
    if not offs:
        return 0
    away = np.abs(np.concatenate(offs))
    sigma = _MAD_TO_SIGMA * float(np.median(away)) or float(np.quantile(away, 0.95))
    return int(np.sum(away > _SUSPECT * sigma)) if sigma > 0 else int(np.sum(away > 0))


def _points(table: _Table, source: str, reference: str) -> list[Point]:
    difference = table.angles[source] - table.angles[reference]
    points: list[Point] = []
    for angle in np.unique(np.round(table.commanded, 9)).tolist():
        for approach in (1, -1, 0):
            chosen = (np.abs(table.commanded - angle) < 1e-8) & (table.approach == approach)
            known = difference[chosen][np.isfinite(difference[chosen])]
            if len(known):
                sd = float(np.std(known, ddof=1)) if len(known) > 1 else 0.0
                points.append(
                    Point(source=source, angle_rad=angle, approach=approach,
                          difference_rad=float(np.mean(known)), sd_rad=sd, count=len(known))
                )  # fmt: skip
    return points
