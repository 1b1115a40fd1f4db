"""The laws of a sole against a block on many points, which knows neither a resultant nor a limit surface."""

from __future__ import annotations

import numpy as np
import pytest

from station.diagnosis.likelihood.leading import PRESSURE_LEAD
from station.physics.catalogue import catalogue
from station.physics.contact import Array
from station.physics.dissipation import threshold
from station.physics.model import Model, Term
from station.physics.topple import lower_edge
from station.simulators.planar.commands import ramps
from station.simulators.planar.simulate import simulate
from tests.contracts.effect_states import contacts, views
from tests.unit.physics.contact_points import POINTS, STEP_S, ManyPoints

MU, YAW_RAD, SECONDS = 0.4, 0.7, 0.15
SIDE_M = 0.01
SLIDES = [((0.1, 0.0, 0.0), 0.45), ((0.4, 0.0, 0.0), 0.1)]
"""Down a slope that is too steep to stop on, and to a stop."""


def uneven(gradient_per_m: tuple[float, float], *, height_m: float = 0.0) -> Model:
    """The law's model of a sole whose friction grows linearly; the points' second moment is that of their grid."""
    second = SIDE_M**2 / 12.0 * (1.0 - POINTS**-2.0)
    arm = {"x_m": gradient_per_m[0] * second, "y_m": gradient_per_m[1] * second}
    return off_the_mass({**arm, "lead": MU * height_m / SIDE_M})


def off_the_mass(arm: dict[str, float]) -> Model:
    """Friction that acts beside the mass."""
    effect = catalogue()["uneven_contact"]
    return Model(mu_s=MU, terms=(Term(effect, {**effect.neutral(), **arm}),))


def planar(model: Model, velocity: tuple[float, float, float], tilt_rad: float, path: Array) -> Array:
    """The planar simulator's path at the many points' moments (m, 3)."""
    commands = ramps((0.0, 3.0), (tilt_rad, tilt_rad), velocity=[velocity], start=[[0.0, 0.0, YAW_RAD]])
    return simulate(commands, model, time_s=np.arange(len(path)) * STEP_S).path[0]


@pytest.mark.parametrize("height_m", [0.0, 0.005])
def test_a_mass_off_the_middle_of_an_even_sole_turns_nothing(height_m: float) -> None:
    """However high it is, and though the sole lifts behind: only the many points know where the pressure is."""
    block = ManyPoints(mu=MU, height_m=height_m, offset_m=(1e-3, 0.5e-3))
    path = block.slid((0.1, 0.0, 0.0), tilt_rad=0.45, yaw_rad=YAW_RAD, seconds=SECONDS)
    assert np.ptp(path[:, 2]) < 1e-9
    assert path == pytest.approx(planar(Model(mu_s=MU), (0.1, 0.0, 0.0), 0.45, path), abs=1e-7)


@pytest.mark.parametrize(("velocity", "tilt_rad"), SLIDES)
@pytest.mark.parametrize("gradient_per_m", [(20.0, 0.0), (40.0, 30.0), (-60.0, 20.0)])
def test_friction_that_grows_over_the_sole_turns_the_block_as_the_law_says(
    velocity: tuple[float, float, float], tilt_rad: float, gradient_per_m: tuple[float, float]
) -> None:
    """The block turns by 9° to 34° to 2 %, and as far along; plain friction would be off by 0.15 mm."""
    block = ManyPoints(mu=MU, gradient_per_m=gradient_per_m)
    path = block.slid(velocity, tilt_rad=tilt_rad, yaw_rad=YAW_RAD, seconds=SECONDS)
    law = planar(uneven(gradient_per_m), velocity, tilt_rad, path)
    turned = path[-1, 2] - YAW_RAD
    assert abs(turned) > np.radians(8.0)
    assert law[-1, 2] - YAW_RAD == pytest.approx(turned, rel=0.02)
    assert law[:, :2] == pytest.approx(path[:, :2], abs=1e-4)


@pytest.mark.parametrize("length_m", [0.03, 0.009])
@pytest.mark.parametrize("sizes", [(0.2, 0.0), (0.1, 0.15)])
def test_a_block_turns_at_the_border_of_a_patch_as_the_law_says(length_m: float, sizes: tuple[float, float]) -> None:
    """It turns by 2° to 30°, told to a tenth of it: a sole of 10 mm is not small beside waves of 9 mm over 2π."""
    beside, across = sizes

    def patch(place: Array) -> Array:
        u, v = place.T / length_m
        return beside * np.sin(v) + across * np.sin(u) * np.sin(v)

    effect = catalogue()["friction_patch"]
    sole = {"turning": 1.0 - POINTS**-2.0, "length_m": length_m}
    law = Model(mu_s=MU, terms=(Term(effect, {**effect.neutral(), "slope_y": beside, "twist": across, **sole}),))
    path = ManyPoints(mu=MU, plate=patch).slid((0.1, 0.0, 0.0), tilt_rad=0.45, yaw_rad=YAW_RAD, seconds=SECONDS)
    told = planar(law, (0.1, 0.0, 0.0), 0.45, path)
    turned = np.abs(path[:, 2] - YAW_RAD).max()
    assert turned > np.radians(2.0)
    assert told[:, 2] == pytest.approx(path[:, 2], abs=0.1 * turned)
    assert told[:, :2] == pytest.approx(path[:, :2], abs=2.5e-4)


@pytest.mark.parametrize("yaw_rad", [YAW_RAD, YAW_RAD + np.pi, 2.0])
def test_a_tall_block_meets_the_friction_in_front_of_it(yaw_rad: float) -> None:
    """A cube goes up to 2.7 mm farther or less far than a flat block, and 0.6 mm aside: the law leaves 0.2 mm."""
    block = ManyPoints(mu=MU, gradient_per_m=(0.0, 40.0), height_m=0.5 * SIDE_M)
    path = block.slid((0.1, 0.0, 0.0), tilt_rad=0.45, yaw_rad=yaw_rad, seconds=SECONDS)
    tall = Term(PRESSURE_LEAD, {"lead": 0.5 * MU})
    model = uneven((0.0, 40.0), height_m=0.5 * SIDE_M).with_term(tall)
    commands = ramps((0.0, 3.0), (0.45, 0.45), velocity=[(0.1, 0.0, 0.0)], start=[[0.0, 0.0, yaw_rad]])
    law = simulate(commands, model, time_s=np.arange(len(path)) * STEP_S).path[0]
    assert law[:, :2] == pytest.approx(path[:, :2], abs=2.5e-4)
    assert law[-1, 2] - yaw_rad == pytest.approx(path[-1, 2] - yaw_rad, rel=0.12)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_tall_block_on_a_patch_meets_the_friction_in_front_of_it(way: float) -> None:
    """A cube goes 0.4 mm less and 0.7 mm farther than a flat block, uphill and downhill in friction; 0.1 mm is left."""

    def patch(place: Array) -> Array:
        return 0.3 * np.sin(place[:, 0] / 0.03)

    effect = catalogue()["friction_patch"]
    shape = {"turning": 1.0 - POINTS**-2.0, "length_m": 0.03, "slope_x": 0.3}
    velocity = (0.25 * way, 0.0, 0.0)
    path = ManyPoints(mu=MU, plate=patch, height_m=0.5 * SIDE_M).slid(
        velocity, tilt_rad=0.2 * way, yaw_rad=YAW_RAD, seconds=SECONDS
    )
    flat, tall = (
        planar(
            Model(mu_s=MU, terms=(Term(effect, {**effect.neutral(), **shape, "lead": lead}),)),
            velocity,
            0.2 * way,
            path,
        )
        for lead in (0.0, 0.5 * MU)
    )
    assert np.abs(flat[:, 0] - path[:, 0]).max() > 3e-4
    assert tall[:, 0] == pytest.approx(path[:, 0], abs=1.2e-4)


@pytest.mark.parametrize("load_rad", [0.0, 0.5, np.pi / 2, 2.5])
def test_an_uneven_contact_at_rest_holds_what_its_points_hold(load_rad: float) -> None:
    """The threshold to a thousandth, where an arm of half a millimetre takes up to 1.4 % of it."""
    block, state = ManyPoints(mu=MU, gradient_per_m=(60.0, 0.0)), contacts(1, moving=False, yaw_rad=0.0, area_m2=1e-4)
    held, _ = threshold(uneven((60.0, 0.0)), state, np.array([load_rad]))
    assert held[0] == pytest.approx(block.holds(load_rad), rel=1e-3)


def test_friction_by_the_load_makes_an_uneven_contact_of_an_offset_mass() -> None:
    """With mu ~ p^-n on a flat block friction acts at -n d from the mass."""
    block = ManyPoints(mu=MU, offset_m=(0.5e-3, 0.0), load_power=1.0 / 3.0)
    path = block.slid((0.1, 0.0, 0.0), tilt_rad=0.45, yaw_rad=YAW_RAD, seconds=SECONDS)
    law = planar(off_the_mass({"x_m": -0.5e-3 / 3.0}), (0.1, 0.0, 0.0), 0.45, path)
    assert law[-1, 2] - YAW_RAD == pytest.approx(path[-1, 2] - YAW_RAD, rel=0.1)


@pytest.mark.parametrize("down_rad", [0.0, 0.3, np.pi / 2, np.pi, 5.0])
def test_a_block_topples_where_no_pressure_balances_it_any_more(down_rad: float) -> None:
    """A cube with its mass 1 mm off the middle: 38.7° to one side and 50.2° to the other."""
    offset = (1e-3, -0.4e-3)
    block = ManyPoints(mu=5.0, height_m=0.5 * SIDE_M, offset_m=offset)
    corner = 0.5 * SIDE_M * np.array([[[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]])
    view = views(1, point_m=corner, down_rad=np.array([down_rad]))
    wide = view.side_m / SIDE_M
    _, stands = lower_edge(view, slenderness=1.0, offset_m=(offset[0] * wide, offset[1] * wide))
    assert block.stands(stands[0] - 1e-6, down_rad)
    assert not block.stands(stands[0] + 1e-6, down_rad)
