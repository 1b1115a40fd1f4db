"""The parts of the limit curve's fit: the geometry of maximum dissipation, the likelihood's gradient, the families."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from shared.messages import Sample
from station.friction.limit_curve.choice import choose
from station.friction.limit_curve.climb import climb
from station.friction.limit_curve.curve import FrictionDistribution, LimitCurveFit
from station.friction.limit_curve.families import Multipliers, choose_family, fit_family
from station.friction.limit_curve.likelihood import Likelihood
from station.friction.limit_curve.multiplier import FAMILIES, Family, Multiplier
from station.friction.limit_curve.observations import Observations, observations_of
from station.friction.limit_curve.of_pair import chosen_curve, fit_of
from station.friction.limit_curve.parameters import Layout
from station.friction.limit_curve.shape import Ellipse, Frame, Kind, LimitCurve, Shape
from station.friction.pairs import Session, pairs_of
from tests.recovery.passive_rig import Rig, ellipse, sessions
from tests.unit.friction.sessions import GEOMETRY, sample, session

Floats = NDArray[np.float64]
OVAL = Shape(stretch=(0.25, 0.35))
SHAPES = {
    "circle": Shape(),
    "ellipse": OVAL,
    "one-way": replace(OVAL, one_way=(0.1, -0.05)),
    "general": Shape(stretch=(0.2, 0.1), one_way=(0.08, 0.02), third=(0.01, -0.01), fourth=(0.008, 0.0)),
}
MEMBERS = (
    Multiplier("lognormal", (1.0, 0.12)),
    Multiplier("gamma", (40.0, 0.025)),
    Multiplier("weibull", (8.0, 1.05)),
    Multiplier("log_t", (1.0, 0.1, 4.0)),
)


def test_runs_that_hardly_scatter_lie_below_or_above() -> None:
    """A session without scatter has a shape whose powers pass the largest number: no warning, and the limit."""
    narrow = Multiplier("weibull", (1e5, 1.0))
    assert narrow.below([0.9, 1.1]).tolist() == [0.0, 1.0]
    assert narrow.above([0.9, 1.1]).tolist() == [1.0, 0.0]
    assert narrow.log_density([1.1]).tolist() == [-np.inf]


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_the_block_starts_and_slides_as_maximum_dissipation_says(shape: Shape):
    curve = LimitCurve(level=0.37, object=shape)
    assert curve.convexity() > 0
    pulls, all_ways = np.linspace(0, 2 * math.pi, 37), np.linspace(0, 2 * math.pi, 7201)
    friction = curve.mu(all_ways)
    for pull, force, slide in zip(pulls, curve.force(pulls), curve.slide(pulls), strict=True):
        surplus = force * np.cos(pull - all_ways) - friction
        assert surplus.max() == pytest.approx(0.0, abs=1e-6)
        assert abs((all_ways[surplus.argmax()] - slide + math.pi) % (2 * math.pi) - math.pi) < 0.01


def test_an_ellipse_is_an_ellipse_and_the_nearest_to_itself():
    planted = Ellipse(mu_1=0.6, mu_2=0.3, axis_rad=2.0)
    stretch = math.log(2.0)
    shape = Shape(stretch=(stretch * math.cos(4.0), stretch * math.sin(4.0)))
    curve = LimitCurve(level=math.sqrt(0.18) * math.cosh(stretch / 2), object=shape)
    phi = np.linspace(0, 2 * math.pi, 50)
    assert curve.mu(phi) == pytest.approx(planted.mu(phi), rel=1e-5)
    along = phi - planted.axis_rad
    assert 1 / curve.force(phi) == pytest.approx(np.hypot(np.cos(along) / 0.6, np.sin(along) / 0.3), rel=1e-5)
    found = curve.ellipse()
    assert (found.mu_1, found.mu_2, found.axis_rad) == pytest.approx((0.6, 0.3, 2.0))


def test_a_curve_of_both_is_the_product_at_the_objects_orientation():
    both = LimitCurve(level=0.4, frame="both", object=SHAPES["general"], plate=OVAL)
    phi = np.linspace(0, 6, 20)
    of_object, of_plate = (LimitCurve(level=1.0, object=shape).mu for shape in (SHAPES["general"], OVAL))
    assert both.mu(phi, orientation_rad=0.7) == pytest.approx(0.4 * of_object(phi) * of_plate(phi + 0.7))


def mixed_runs(count: int, rng: np.random.Generator) -> Observations:
    """Runs of every kind: resolved, censored, bracketed, from the first step, or seen only from a pull on."""
    pull, unknown = rng.normal(-1, 0.1, count), np.full(count, np.nan)
    above, below, seen = unknown.copy(), unknown.copy(), np.full(count, -np.inf)
    above[:40], below[:20] = pull[:40], np.inf
    below[20:40] = above[20:40] + 0.05
    above[35:40] = -np.inf
    seen[60:80] = -1.2
    pull[:40] = np.nan
    towards, slid = rng.uniform(0, 2 * math.pi, count), rng.normal(0, 0.1, count)
    slid[:20] = np.nan
    return Observations(
        pull=pull,
        pull_sigma=np.full(count, 0.01),
        above=above,
        below=below,
        seen_from=seen,
        towards_object_rad=towards,
        towards_plate_rad=towards + rng.uniform(0, 6, count),
        slide_rad=towards + slid,
        slide_sigma_rad=np.full(count, 0.01),
        place=np.linspace(-1, 1, count),
    )


@pytest.mark.parametrize("frame", ["object", "plate", "both"])
@pytest.mark.parametrize("kind", ["isotropic", "ellipse", "general"])
def test_the_gradient_is_that_of_the_likelihood(kind: Kind, frame: Frame):
    rng = np.random.default_rng(2)
    layout = Layout(kind, frame)
    likelihood = Likelihood(layout, mixed_runs(120, rng))
    set_values = {"level": -1, "log_scatter": -2.3, "tail": 0.1, "log_direction_scatter": -2.5, "ease": 0.8}
    set_values |= {"drift": 0.02, "direction_tail": 0.2, "turn": 0.02}
    at = np.array([set_values.get(name, 0.2 if ".2." in name else 0.01) for name in layout.names])
    _, gradient = likelihood(at)
    for place in range(len(at)):
        step = np.zeros(len(at))
        step[place] = 1e-5
        slope = (likelihood(at + step)[0] - likelihood(at - step)[0]) / 2e-5
        assert gradient[place] == pytest.approx(slope, rel=1e-4, abs=1e-3), layout.names[place]


def test_a_climb_ends_at_the_top_within_its_bounds():
    def height(x: Floats) -> tuple[float, Floats]:
        # Rosenbrock's valley, upside down: its top is at (1, 1).
        a, b = 1 - x[0], x[1] - x[0] ** 2
        return float(-(a**2) - 100 * b**2), np.array([2 * a + 400 * x[0] * b, -200 * b])

    free = climb(height, np.array([-1.2, 1.0]), low=np.full(2, -9.0), high=np.full(2, 9.0))
    assert free == pytest.approx([1, 1], abs=1e-3)
    held = climb(height, np.array([-1.2, 1.0]), low=np.full(2, -9.0), high=np.array([0.5, 9.0]))
    assert held == pytest.approx([0.5, 0.25], abs=1e-3)


@pytest.mark.parametrize("planted", MEMBERS, ids=FAMILIES)
def test_a_family_is_recovered_also_when_runs_are_censored(planted: Multiplier):
    rng = np.random.default_rng(8)
    drawn = planted.draw(rng, 4000)
    assert planted.below(planted.quantile([0.1, 0.5, 0.9])) == pytest.approx([0.1, 0.5, 0.9])
    middles = np.linspace(0.5, 2.0, 1501)
    mass = np.exp(planted.log_density(middles)).sum() * (middles[1] - middles[0])
    assert mass == pytest.approx(float(planted.below(2.0) - planted.below(0.5)), abs=0.002)
    limit = float(planted.quantile(0.8))
    cut = drawn > limit
    runs = Multipliers(
        value=np.where(cut, np.nan, drawn), above=np.where(cut, limit, np.nan), below=np.where(cut, np.inf, np.nan)
    )
    found, _ = fit_family(planted.family, runs)
    assert found.quantile([0.1, 0.5, 0.9]) == pytest.approx(planted.quantile([0.1, 0.5, 0.9]), rel=0.02)


def test_the_right_family_is_chosen_and_fits_and_a_wrong_one_does_not():
    rng = np.random.default_rng(3)
    drawn, unknown = MEMBERS[2].draw(rng, 500), np.full(500, np.nan)
    member, goodness = choose_family(Multipliers(drawn, unknown, unknown), rng=rng, bootstraps=39)
    assert member.family == "weibull"
    assert goodness.p_value > 0.05
    two_heaps = np.concatenate([rng.normal(0.7, 0.02, 250), rng.normal(1.3, 0.02, 250)])
    _, goodness = choose_family(Multipliers(two_heaps, unknown, unknown), rng=rng, bootstraps=39)
    assert goodness.p_value == pytest.approx(1 / 40)


@pytest.mark.parametrize(("family", "parameters"), [("lognormal", (1.0,)), ("gamma", (1.0, -1.0)), ("cauchy", (1.0,))])
def test_a_distribution_that_is_none_is_refused(family: Family, parameters: tuple[float, ...]):
    with pytest.raises(ValueError, match="expected"):
        Multiplier(family, parameters)


def test_draws_are_by_direction_and_by_the_generator():
    friction = FrictionDistribution(LimitCurve(level=0.4, object=OVAL), MEMBERS[0])
    phi = np.array([0.0, 1.0, 2.0])
    drawn = friction.draw(np.random.default_rng(1), phi, size=4000)
    assert drawn.shape == (4000, 3)
    assert np.median(drawn, axis=0) == pytest.approx(friction.curve.mu(phi), rel=0.02)
    assert np.quantile(drawn, 0.9, axis=0) == pytest.approx(friction.quantile(0.9, phi), rel=0.02)
    assert friction.draw(np.random.default_rng(1), 0.5) == friction.draw(np.random.default_rng(1), 0.5)
    assert friction.draw(np.random.default_rng(1), 0.5, size=3).shape == (3,)


def test_a_fit_survives_json():
    runs = sessions(Rig(mu=ellipse(0.42, 0.3)), count=1, runs=120, rng=np.random.default_rng(1)).observations(0)
    fit = fit_of(choose(runs), runs, rng=np.random.default_rng(1), bootstraps=9)
    again = LimitCurveFit.from_dict(json.loads(json.dumps(fit.as_dict(), allow_nan=False)))
    assert repr(again) == repr(fit)
    assert fit.mu([0.0, 1.0]) == pytest.approx(fit.curve.mu([0.0, 1.0]))
    assert fit.ellipse().mu_1 == pytest.approx(fit.estimates["mu_1"].value)
    middle = len(fit.band.mu) // 2
    assert fit.band.low[middle] < fit.band.mu[middle] < fit.band.high[middle]


def observed(samples: list[Sample]) -> Observations:
    (pair,) = pairs_of([Session(samples, GEOMETRY)])
    return observations_of(pair)


def test_a_samples_row_is_its_pull_direction_and_interval():
    quarter = math.pi / 2
    straight = replace(sample(run=1, yaw_rad=0.3), onset_sigma_rad=0.002, plate_mount_rad=0.5)
    censored = replace(sample(run=2, yaw_rad=0.3), censored=True, onset_angle_rad=0.6)
    unresolved = replace(sample(run=3), flags=("onset_unresolved",), step_from_rad=0.33, step_to_rad=0.36)
    unresolved = replace(unresolved, tilt_rate_rad_s=math.radians(5))
    runs = observed([straight, censored, unresolved])
    assert runs.pull[0] == pytest.approx(math.log(math.tan(0.35)))
    step = math.log(math.tan(0.351)) - math.log(math.tan(0.349))
    assert runs.pull_sigma[0] == pytest.approx(step, rel=1e-3)
    assert math.cos(runs.towards_object_rad[0] - (-quarter - 0.3)) == pytest.approx(1)
    assert math.cos(runs.towards_plate_rad[0] - (-quarter - 0.5)) == pytest.approx(1)
    assert math.cos(runs.slide_rad[0] - runs.towards_object_rad[0]) == pytest.approx(1)
    assert runs.censored.tolist() == [False, True, False]
    assert runs.above[1] == pytest.approx(math.log(math.tan(0.6)))
    assert math.isnan(runs.slide_rad[1])
    # Noticed 1.2° late at 5°/s after 2.5 mm, so it may have begun before the step.
    assert 0.30 < math.atan(math.exp(runs.above[2])) < 0.32
    assert math.atan(math.exp(runs.below[2])) == pytest.approx(0.36)


def test_wrong_measurements_are_left_out_and_high_friction_is_not():
    rng = np.random.default_rng(5)
    samples = [*session(60, rng=rng), sample(run=61, slide_m=0.001), sample(run=62, angle_rad=0.9)]
    (pair,) = pairs_of([Session(samples, GEOMETRY)])
    assert pair.flags.by_filter["angle"][61]
    assert len(observations_of(pair)) == 61


def test_too_few_samples_say_what_became_of_the_others():
    """Only 16 of 19 kept samples were said to have a known direction, and nothing told why."""
    leaning = sample(run=1, start_m=(0.0, -0.042), azimuth_rad=0.0)
    held = replace(sample(run=2), censored=True)
    (pair,) = pairs_of([Session([leaning, held, *session(20, rng=np.random.default_rng(5))], GEOMETRY)])
    with pytest.raises(ValueError, match=r"20 samples .* needed. Left out: 1 leaning on the foam, 1 without"):
        chosen_curve(pair)


def test_a_block_that_the_foam_holds_is_left_out_by_its_pull_and_not_by_its_slide():
    held, freed = ((0.0, -0.042), 0.0), ((0.0, -0.042), math.pi)  # tilted about x the plate slopes down towards −y
    samples = [
        replace(sample(run=run, start_m=start, azimuth_rad=azimuth), censored=censored)
        for run, ((start, azimuth), censored) in enumerate([(held, True), (freed, False), (freed, True)])
    ]
    runs = observed([*samples, sample(run=9)])
    assert runs.censored.tolist() == [False, True, False]


def test_what_cannot_be_fitted_is_said():
    with pytest.raises(ValueError, match=r"No limit curve can be fitted to 12 samples .*; 25 are needed\."):
        choose(observed(session(12, rng=np.random.default_rng(1))))
    with pytest.raises(ValueError, match="0 samples with a known direction"):
        choose(observed([Sample(run=run, onset_angle_rad=0.3 + 0.001 * run) for run in range(30)]))
    one_line = [one for one in session(120, rng=np.random.default_rng(2), turning=False) if one.direction % 2]
    choice = choose(observed(one_line))
    assert choice.best.layout.kind == "isotropic"
    assert math.isnan(choice.p_isotropic)
    assert any("along one line" in remark for remark in choice.remarks)
    never_turned = choose(observed(session(60, rng=np.random.default_rng(2), turning=False)))
    assert {score.frame for score in never_turned.scores} == {"object"}
    assert any("hardly turned" in remark for remark in never_turned.remarks)
