"""Limit curves of every kind become ellipses, and say what is lost."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.export.from_fit import pair_of_fit
from station.friction.limit_curve.curve import Band, Estimate, Goodness, LimitCurve, LimitCurveFit, Multiplier, Shape
from station.friction.limit_curve.shape import Kind

ELLIPSE = Shape(stretch=(0.4 * math.cos(1.0), 0.4 * math.sin(1.0)))


def fit(curve: LimitCurve, kind: Kind, **estimates: float) -> LimitCurveFit:
    values = {"scatter": 0.1, **estimates}
    return LimitCurveFit(
        curve=curve,
        kind=kind,
        estimates={name: Estimate(value, value - 0.01, value + 0.01) for name, value in values.items()},
        multiplier=Multiplier("lognormal", (1.0, 0.1)),
        goodness=Goodness(statistic=0.1, p_value=0.5, bootstraps=1, aic={}),
        scores=(),
        band=Band(phi_rad=(), mu=(), low=(), high=()),
        slides=321,
        censored=0,
        bracketed=0,
        p_isotropic=0.01,
        remarks=("a doubt",),
    )


def test_a_circle_is_one_number():
    curve = LimitCurve(level=0.4, frame="plate")
    pair = pair_of_fit(fit(curve, "isotropic", level=0.4), object="a", plate="b")
    assert pair.isotropic
    assert pair.mu_1 == pytest.approx(0.4)
    assert (pair.samples, pair.scatter, pair.one_way, pair.other_ratio) == (321, 0.1, 1.0, 1.0)
    assert pair.misfit_rad < 1e-9
    assert pair.mu_1_interval == pair.mu_2_interval == pytest.approx((0.39, 0.41))
    assert pair.remarks == ("A doubt.",)


@pytest.mark.parametrize("frame", ["object", "plate"])
def test_an_ellipse_holds_what_the_limit_curve_holds(frame: str):
    shapes = {frame: ELLIPSE}
    curve = LimitCurve(level=0.4, frame=frame, **shapes)  # pyright: ignore[reportArgumentType] (both are frames)
    pair = pair_of_fit(fit(curve, "ellipse", mu_1=0.48, mu_2=0.32), object="a", plate="b")
    assert pair.fixed_in == frame
    assert pair.axis_rad == pytest.approx(0.5)
    assert pair.mu_1 / pair.mu_2 == pytest.approx(math.exp(0.4), rel=1e-4)
    phi = np.linspace(0, 2 * math.pi, 37)
    assert pair.force(phi) == pytest.approx(curve.force(phi), rel=1e-4)
    assert pair.mu_1_interval == pytest.approx((0.47, 0.49))
    assert pair.mu_2_interval == pytest.approx((0.31, 0.33))


def test_the_stronger_of_two_ellipses_is_kept():
    for stronger, weaker in (("object", "plate"), ("plate", "object")):
        shapes = {stronger: ELLIPSE, weaker: Shape(stretch=(0.1, 0.0))}
        suffix = "_plate" if stronger == "plate" else ""
        curve = LimitCurve(level=0.4, frame="both", **shapes)  # pyright: ignore[reportArgumentType] (both are bodies)
        pair = pair_of_fit(fit(curve, "ellipse", **{f"mu_1{suffix}": 0.48}), object="a", plate="b")
        assert pair.fixed_in == stronger
        assert pair.other_ratio == pytest.approx(math.exp(0.1))
        assert pair.mu_1_interval[0] == pytest.approx(0.47)
        assert pair.mu_1 / pair.mu_2 == pytest.approx(math.exp(0.4), rel=1e-4)


def test_what_an_ellipse_loses_is_measured():
    one_way = Shape(stretch=ELLIPSE.stretch, one_way=(0.1, 0.0))
    curve = LimitCurve(level=0.4, frame="object", object=one_way)
    pair = pair_of_fit(fit(curve, "one_way", one_way=math.exp(0.2), one_way_rad=0.0), object="a", plate="b")
    assert pair.one_way == pytest.approx(math.exp(0.2))
    phi = np.linspace(0, 2 * math.pi, 180, endpoint=False)
    off = np.abs(np.arctan(curve.force(phi)) - pair.angle_rad(phi)).max()
    assert pair.misfit_rad == pytest.approx(float(off))
    assert math.degrees(pair.misfit_rad) > 1
