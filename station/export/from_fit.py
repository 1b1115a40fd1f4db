"""Turns a fitted limit curve into what simulators can say of it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from station.export.measured import MASS_KG, SIDE_M, UNKNOWN, Array, FixedIn, MeasuredPair
from station.friction.limit_curve.curve import LimitCurve, LimitCurveFit, Shape

_CIRCLE: Array = np.linspace(0, 2 * math.pi, 180, endpoint=False)


def pair_of_fit(
    fit: LimitCurveFit, *, object: str, plate: str, side_m: float = SIDE_M, mass_kg: float = MASS_KG
) -> MeasuredPair:
    """Returns the nearest ellipse of a pair's limit curve with its intervals, and what it leaves out.

    A curve that is fixed in both bodies gives the ellipse of the body whose ratio of axes is the larger.
    """
    fixed_in, other = _carrier(fit.curve)
    alone = _alone(fit.curve, fixed_in)
    ellipse = alone.ellipse()
    suffix = "_plate" if fit.frame == "both" and fixed_in == "plate" else ""
    one_way = fit.estimates.get(f"one_way{suffix}")
    towards = fit.estimates.get(f"one_way_rad{suffix}")
    pair = MeasuredPair(
        object=object,
        plate=plate,
        mu_1=ellipse.mu_1,
        mu_2=min(ellipse.mu_1, ellipse.mu_2),
        axis_rad=ellipse.axis_rad,
        fixed_in=fixed_in,
        mu_1_interval=_interval(fit, f"mu_1{suffix}", "level"),
        mu_2_interval=_interval(fit, f"mu_2{suffix}", "level"),
        one_way=one_way.value if one_way else 1.0,
        one_way_rad=towards.value if towards else 0.0,
        other_ratio=other,
        scatter=fit.scatter,
        samples=fit.slides,
        side_m=side_m,
        mass_kg=mass_kg,
        remarks=tuple(_sentence(remark) for remark in fit.remarks),
    )
    return _with_misfit(pair, alone)


def _carrier(curve: LimitCurve) -> tuple[FixedIn, float]:
    """Returns the body in which the ellipse is fixed, and the ratio of axes of the other body's."""
    if curve.frame != "both":
        return curve.frame, 1.0
    by_object, by_plate = (math.exp(math.hypot(*shape.stretch)) for shape in (curve.object, curve.plate))
    return ("object", by_plate) if by_object >= by_plate else ("plate", by_object)


def _alone(curve: LimitCurve, fixed_in: FixedIn) -> LimitCurve:
    shape: Shape = curve.object if fixed_in == "object" else curve.plate
    return LimitCurve(level=curve.level, frame=fixed_in, **{fixed_in: shape})


def _interval(fit: LimitCurveFit, *names: str) -> tuple[float, float]:
    """Returns the interval of the first of these estimates that there is: a circle has its level alone."""
    for name in names:
        if estimate := fit.estimates.get(name):
            return estimate.low, estimate.high
    return UNKNOWN


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:] + ("" if text.endswith(".") else ".")


def _with_misfit(pair: MeasuredPair, curve: LimitCurve) -> MeasuredPair:
    off = np.arctan(curve.force(_CIRCLE)) - pair.angle_rad(_CIRCLE)
    return replace(pair, misfit_rad=float(np.abs(off).max()))
