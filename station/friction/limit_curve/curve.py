"""A pair's friction by direction: a limit curve with intervals, and its scatter.

These are what `limit_curves.json` holds and what an exporter takes. Directions are against the frame's x; see
`LimitCurve` for the frames. All intervals are 90 %.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from station.friction.direction import Array
from station.friction.limit_curve.multiplier import Family, Multiplier
from station.friction.limit_curve.shape import Ellipse, Frame, Kind, LimitCurve, Shape

LEVEL = 0.9
"""The probability with which every interval holds the truth."""

__all__ = [
    "LEVEL",
    "Band",
    "Ellipse",
    "Estimate",
    "FrictionDistribution",
    "Goodness",
    "LimitCurve",
    "LimitCurveFit",
    "Multiplier",
    "Score",
    "Shape",
]


@dataclass(frozen=True, slots=True)
class FrictionDistribution:
    """Friction as a random number: the limit curve, all of it multiplied by what varies from run to run."""

    curve: LimitCurve
    multiplier: Multiplier

    def draw(
        self, rng: np.random.Generator, slide_rad: ArrayLike, size: int | None = None, *, orientation_rad: float = 0.0
    ) -> Array:
        """Draws of mu for slides in the directions `slide_rad` (n,): (n,), or (size, n), each a run of its own.

        One direction (a plain number) gives () or (size).
        """
        mu = self.curve.mu(slide_rad, orientation_rad=orientation_rad)
        shape = mu.shape if size is None else (size, *mu.shape)
        return mu * self.multiplier.draw(rng, shape)

    def quantile(self, probability: float, slide_rad: ArrayLike, *, orientation_rad: float = 0.0) -> Array:
        """Returns the coefficient that friction does not reach with this probability, by direction (n,)."""
        return self.curve.mu(slide_rad, orientation_rad=orientation_rad) * self.multiplier.quantile(probability)


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value and its 90 % interval; both ends NaN where there is none."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """The score of one kind of curve. `shape_parameters` counts what gives it its shape.

    `p_value` is the likelihood-ratio test's against the kind `against` that it contains (NaN and "" for none); `bic`
    is smaller where it is better.
    """

    kind: Kind
    frame: Frame
    shape_parameters: int
    log_likelihood: float
    bic: float
    against: str
    p_value: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Goodness:
    """The goodness of fit of the scatter's family: Anderson and Darling's A², its p-value by parametric bootstrap.

    `aic` are the families' information criteria, by name, less that of the best.
    """

    statistic: float
    p_value: float
    bootstraps: int
    aic: Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Band:
    """The curve over the circle: friction and its 90 % interval by direction, each (k,); pointwise, not of all."""

    phi_rad: tuple[float, ...]
    mu: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitCurveFit:
    """A pair's limit curve and scatter.

    `estimates` has what can be named, by name: mu_1, mu_2, ratio and axis_rad of the ellipse; one_way (the ratio of
    friction forwards and backwards) and one_way_rad (the direction of the higher); scatter (of ln mu from run to run);
    drift (of ln mu over the session); direction_scatter_rad; ease. Those of the plate end in "_plate" in the frame
    "both". `slides` gave onset and direction, `censored` only that more is needed, `bracketed` an interval of tilts.
    """

    curve: LimitCurve
    kind: Kind
    estimates: Mapping[str, Estimate]
    multiplier: Multiplier
    goodness: Goodness
    scores: tuple[Score, ...]
    band: Band
    slides: int
    censored: int
    bracketed: int
    p_isotropic: float
    remarks: tuple[str, ...] = ()

    @property
    def frame(self) -> Frame:
        """The body against which the directions are."""
        return self.curve.frame

    @property
    def scatter(self) -> float:
        """Standard deviation (or Student's scale) of ln mu from run to run."""
        return self.estimates["scatter"].value

    @property
    def distribution(self) -> FrictionDistribution:
        """Friction by direction as a random number."""
        return FrictionDistribution(self.curve, self.multiplier)

    def mu(self, phi_rad: ArrayLike, *, orientation_rad: float = 0.0) -> Array:
        """Returns the median friction coefficient of slides in the directions phi (n,)."""
        return self.curve.mu(phi_rad, orientation_rad=orientation_rad)

    def force(self, phi_rad: ArrayLike, *, orientation_rad: float = 0.0) -> Array:
        """Returns the force (n,) that the contact holds, over the normal force, by pulls' directions phi (n,), rad."""
        return self.curve.force(phi_rad, orientation_rad=orientation_rad)

    def ellipse(self, *, orientation_rad: float = 0.0) -> Ellipse:
        """Returns the nearest ellipse, for what knows no other curve."""
        return self.curve.ellipse(orientation_rad=orientation_rad)

    def as_dict(self) -> dict[str, Any]:
        """Returns plain numbers, texts, lists and tables, as JSON takes them; None in the place of NaN."""
        plain: dict[str, Any] = _plain(asdict(self))
        return plain

    @classmethod
    def from_dict(cls, table: Mapping[str, Any]) -> Self:
        """Returns the fit again from what `as_dict` gave, also after a way through JSON.

        Raises:
            KeyError, TypeError, ValueError: if it is none.
        """
        return cls(
            curve=_curve(table["curve"]),
            kind=table["kind"],
            estimates={
                name: Estimate(*(_number(row[key]) for key in ("value", "low", "high")))
                for name, row in table["estimates"].items()
            },
            multiplier=_multiplier(table["multiplier"]),
            goodness=_goodness(table["goodness"]),
            scores=tuple(_score(row) for row in table["scores"]),
            band=Band(**{name: tuple(values) for name, values in table["band"].items()}),
            slides=int(table["slides"]),
            censored=int(table["censored"]),
            bracketed=int(table["bracketed"]),
            p_isotropic=_number(table["p_isotropic"]),
            remarks=tuple(table["remarks"]),
        )


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    return None if isinstance(value, float) and math.isnan(value) else value


def _number(value: float | None) -> float:
    """Returns the number, or NaN for null, which stands for it as JSON has none."""
    return float("nan") if value is None else float(value)


def _goodness(table: Mapping[str, Any]) -> Goodness:
    values: dict[str, Any] = {**table, "p_value": _number(table["p_value"])}
    return Goodness(**values)


def _score(table: Mapping[str, Any]) -> Score:
    values: dict[str, Any] = {**table, "p_value": _number(table["p_value"])}
    return Score(**values)


def _multiplier(table: Mapping[str, Any]) -> Multiplier:
    family: Family = table["family"]
    return Multiplier(family, tuple(float(value) for value in table["parameters"]))


def _curve(table: Mapping[str, Any]) -> LimitCurve:
    return LimitCurve(
        level=float(table["level"]), frame=table["frame"], object=_shape(table["object"]), plate=_shape(table["plate"])
    )


def _shape(table: Mapping[str, Any]) -> Shape:
    return Shape(**{name: (float(pair[0]), float(pair[1])) for name, pair in table.items()})
