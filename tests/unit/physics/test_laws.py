"""The laws against what is known of them: by hand, by geometry, by published figures."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from station.physics.catalogue import catalogue
from station.physics.contact import GRAVITY_M_S2, Array, Contact, View
from station.physics.dissipation import threshold
from station.physics.model import Model, Term
from station.physics.reversals import turned_at
from tests.contracts.effect_states import answer, contacts, read_only, views

KNOWN = catalogue()
SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def said(name: str, hook: str, state: Contact | View, **values: float) -> Array:
    """Returns what an effect says."""
    effect = KNOWN[name]
    return answer(effect, hook, effect.neutral() | values, state).copy()


def at_rest(count: int = 12, **fixed: Any) -> Contact:
    """Blocks at rest."""
    return contacts(count, moving=False, speed_m_s=0.0, slid_s=0.0, **fixed)


def around(state: Contact) -> Contact:
    """The same blocks with ways all round."""
    return replace(state, way_rad=read_only(np.linspace(-np.pi, np.pi, len(state), endpoint=False)))


# --- directions -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "turned_by"), [("object_anisotropy", "yaw_rad"), ("plate_anisotropy", "mount_rad")])
def test_ellipse_has_the_ratio_and_the_mean_that_it_names(name: str, turned_by: str) -> None:
    """Axes exp(± r / 2), the larger one at half the components' angle; mu_s is their geometric mean."""
    state = around(at_rest(3600, **{turned_by: 0.3}))
    curve = said(name, "friction", state, cos2=0.3, sin2=0.4)
    assert np.max(curve) / np.min(curve) == pytest.approx(np.exp(0.5), rel=1e-5)
    assert np.max(curve) * np.min(curve) == pytest.approx(1.0, rel=1e-5)
    stiffest = state.way_rad[np.argmax(curve)] - 0.3
    assert np.cos(2 * stiffest - np.arctan2(0.4, 0.3)) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize(
    ("name", "folds", "size", "shape"),
    [
        ("plate_anisotropy", 2, {"cos2": 0.2}, {"shape": 0.5}),
        ("one_way_friction", 1, {"cos1": float(np.tanh(0.1))}, {"pinch": 1.0}),
    ],
)
def test_a_shape_makes_the_force_that_is_held_a_cosine(
    name: str, folds: int, size: dict[str, float], shape: dict[str, float]
) -> None:
    """1 + a cos kψ with a = tanh(s / 2) ≈ 0.1; the unshaped curve is off by a share of a²."""
    state = at_rest(360, mount_rad=0.0)
    load = np.linspace(-np.pi, np.pi, 360, endpoint=False)

    def off(**values: float) -> float:
        effect = KNOWN[name]
        held, _ = threshold(Model(mu_s=1.0, terms=(Term(effect, effect.neutral() | values),)), state, load)
        return float(np.max(np.abs(held / held.mean() - 1.0 - np.tanh(0.1) * np.cos(folds * load))))

    assert off(**size, **shape) < 1e-5
    assert off(**size) > 2e-3


def test_four_directions_cannot_see_the_sine_of_twice_the_angle() -> None:
    """The first order of sin 2φ is invisible along x and y."""
    state = at_rest(4, mount_rad=0.0)
    axes = replace(state, way_rad=np.radians([0.0, 90.0, 180.0, 270.0]))
    np.testing.assert_allclose(said("plate_anisotropy", "friction", axes, sin2=1e-4), 1.0, atol=1e-8)


def test_the_grain_turns_with_the_plate_and_the_level_error_does_not() -> None:
    """The experiment that separates them: 180° in the mount."""
    state = around(at_rest(16, mount_rad=0.0))
    remounted = replace(state, mount_rad=np.full(16, np.pi))
    before, after = (said("one_way_friction", "friction", one, cos1=0.2, sin1=0.1) for one in (state, remounted))
    np.testing.assert_allclose(before - 1.0, 1.0 - after, atol=1e-12)
    levels = [said("platform_level", "attitude", one, eps_x_rad=0.01) for one in (state, remounted)]
    np.testing.assert_array_equal(levels[0], levels[1])


def test_a_pyramid_holds_less_at_45_degrees() -> None:
    """26.6° on the axes and 19.5° between them, for mu = 0.5; the rounding of the kink costs half a degree there."""
    state = at_rest(2)
    model = Model(mu_s=0.5, terms=(Term(KNOWN["cone_artifact"], {"share": 1.0}),))
    held = model.friction(replace(state, way_rad=np.radians([0.0, 45.0])))
    np.testing.assert_allclose(np.degrees(np.arctan(held)), [26.565, 19.471], atol=0.5)


# --- load -------------------------------------------------------------------------------------------------------------


def test_adhesion_gives_the_published_onset() -> None:
    """The load and friction balance where tan θ = mu (1 + F / (m g cos θ))."""
    mu, force, mass = 0.4, 0.03, 0.01
    tilt = np.linspace(0.3, 0.9, 6001)
    state = at_rest(len(tilt), mass_kg=mass, tilt_rad=tilt)
    model = Model(mu_s=mu, terms=(Term(KNOWN["adhesion"], {"force_n": force}),))
    normal = state.pressing_m_s2 - model.push(state)[:, 2]
    held, _ = threshold(model, state, state.down_rad)
    found = tilt[np.argmin(np.abs(GRAVITY_M_S2 * np.sin(tilt) - held * normal))]
    assert np.tan(found) == pytest.approx(mu * (1 + force / (mass * GRAVITY_M_S2 * np.cos(found))), rel=1e-3)


def test_load_and_adhesion_need_a_second_mass() -> None:
    """With one mass mu takes them up; with two they can be told."""
    for name in ("adhesion", "load_dependence"):
        one, two = at_rest(6, mass_kg=0.02), at_rest(6, mass_kg=np.array([0.02, 0.1] * 3))
        assert "one mass" in str(KNOWN[name].why_untestable(one))
        assert KNOWN[name].why_untestable(two) is None


def test_a_heavier_elastomer_has_the_smaller_coefficient() -> None:
    """Eight times the load halves it at n = 1/3."""
    state = at_rest(2, mass_kg=np.array([0.02, 0.16]), tilt_rad=0.0)
    light, heavy = said("load_dependence", "friction", state, exponent=1 / 3)
    assert light / heavy == pytest.approx(2.0)


# --- speed and history ------------------------------------------------------------------------------------------------


def test_stribeck_goes_from_static_to_kinetic() -> None:
    """Continuous with rest; the kinetic drop when the speed is far above its scale."""
    state = contacts(3, moving=True, speed_m_s=np.array([0.0, 0.01, 10.0]))
    slow, at_scale, fast = said("stribeck", "friction", state, drop=0.3, speed_m_s=0.01)
    assert slow == 1.0
    assert at_scale == pytest.approx(1.0 - 0.3 * (1 - np.exp(-1)))
    assert fast == pytest.approx(said("kinetic_drop", "friction", state, drop=0.3)[0])


def test_the_tail_of_a_fall_leads_from_the_gaussian_to_the_lorentzian() -> None:
    """The two have exponent 2; an exponential has no other tail."""
    ratio = np.array([0.3, 1.0, 2.0, 4.0])
    state = contacts(4, moving=True, speed_m_s=0.01 * ratio)
    for exponent, tail, left in (
        (2.0, 0.0, np.exp(-(ratio**2))),
        (2.0, 1.0, 1 / (1 + ratio**2)),
        (1.0, 0.0, np.exp(-ratio)),
        (1.0, 1.0, np.exp(-ratio)),
    ):
        found = said("stribeck", "friction", state, drop=0.3, speed_m_s=0.01, exponent=exponent, tail=tail)
        np.testing.assert_allclose(found, 1.0 - 0.3 * (1.0 - left), rtol=1e-5)


def test_rate_begins_at_the_static_friction_and_grows_by_e_folds() -> None:
    """ln(1 + v / v0): nothing at rest, ln 2 at the cut-off, a for each e-fold far above it."""
    cut_off = 0.1 * 10.0**-2.5
    speeds = np.array([1e-12, cut_off, 1e3 * cut_off, np.e * 1e3 * cut_off])
    state = contacts(4, moving=True, speed_m_s=speeds)
    factor = said("rate_strengthening", "friction", state, per_e_fold=0.02, slower_decades=2.5)
    np.testing.assert_allclose(factor[:2], [1.0, 1.0 + 0.02 * np.log(2.0)], atol=1e-9)
    assert factor[3] - factor[2] == pytest.approx(0.02, rel=1e-3)


def test_activated_slips_that_go_both_ways_halve_the_slope_at_rest_and_change_nothing_far_above() -> None:
    """asinh(v / 2 v0), the regularised law of rate and state."""
    cut_off = 0.1 * 10.0**-2.5
    speeds = np.array([0.0, 1e-4, 1.0, 2.0, 1e4]) * cut_off
    state = contacts(5, moving=True, speed_m_s=speeds)
    one, both = (
        said("rate_strengthening", "friction", state, per_e_fold=0.02, slower_decades=2.5, both_ways=share)
        for share in (0.0, 1.0)
    )
    np.testing.assert_allclose(both, 1.0 + 0.02 * np.arcsinh(speeds / (2.0 * cut_off)), atol=1e-4)
    assert (both[1] - 1.0) / (one[1] - 1.0) == pytest.approx(0.5, rel=5e-3)
    assert both[4] == pytest.approx(one[4], abs=1e-5)


def test_friction_that_grows_with_the_speed_creeps_below_its_limit_and_goes_on_as_it_slides() -> None:
    """The logarithm without its 1 + is mu_s (1 + a ln(v / v0)) at all speeds: at 3 e-folds below the limit v0 / e³."""
    spare, cut_off, size = np.array([0.01, 0.06, 0.5]), 1e-3, 0.02
    state = at_rest(3, spare_m_s2=spare, tilt_rad=np.full(3, 0.3), down_rad=np.zeros(3))
    values = {"per_e_fold": size, "slower_decades": 2.0, "creep_share": 1.0}
    creep = said("rate_strengthening", "creep", state, **values)
    holds = spare + GRAVITY_M_S2 * np.sin(0.3)
    np.testing.assert_allclose(1.0 + size * np.log(creep[:, 0] / cut_off), 1.0 - spare / holds, rtol=1e-12)
    for other in ({"creep_share": 0.0}, {"per_e_fold": -size}, {"per_e_fold": 0.0}):
        assert np.all(said("rate_strengthening", "creep", state, **values | other) == 0.0)


def test_only_contacts_at_rest_age_and_only_sliding_ones_drop() -> None:
    """Sliding renews the contact."""
    rest, slide = at_rest(rest_s=100.0), contacts(12, moving=True, rest_s=100.0)
    assert np.all(said("contact_aging", "friction", rest, per_decade=0.03) > 1.02)
    for name, state in (("contact_aging", slide), ("kinetic_drop", rest), ("stribeck", rest)):
        first = KNOWN[name].parameters[0].name
        assert np.all(said(name, "friction", state, **{first: 0.1}) == 1.0)


def test_wear_settles() -> None:
    """63 % of the fall after n0 runs, all of it in the end, none before the first."""
    state = at_rest(3, run=np.array([0.0, 50.0, 5000.0]))
    np.testing.assert_allclose(said("wear", "friction", state, fall=0.2, runs=50.0), [1.0, 0.87358, 0.8], atol=1e-5)


# --- place and mass ---------------------------------------------------------------------------------------------------


def test_a_patch_turns_with_the_plate() -> None:
    """A patch right of the centre is above it after a quarter turn."""
    state = at_rest(2, x_m=np.array([0.02, 0.0]), y_m=np.array([0.0, 0.02]), mount_rad=np.array([0.0, np.pi / 2]))
    right, above = said("friction_patch", "friction", state, slope_x=0.2, bowl=0.1, length_m=0.04, turning=0.0)
    assert right == pytest.approx(np.exp(0.2 * np.sin(0.5) + 0.1 * (1.0 - np.cos(0.5))))
    assert above == pytest.approx(right)


def test_a_patch_turns_a_block_by_its_slope() -> None:
    """The lever of every term is the slope of ln mu across the way, by differences of the friction itself."""
    state, near = contacts(40, moving=True), 1e-7
    sizes = {one.name: 0.02 * (number + 1) for number, one in enumerate(catalogue()["friction_patch"].parameters[:8])}

    def log_friction(**moved_m: Array) -> Array:
        there = replace(state, **{name: getattr(state, name) + by_m for name, by_m in moved_m.items()})
        return np.log(said("friction_patch", "friction", there, **sizes, length_m=0.011))

    left_x, left_y = -near * np.sin(state.way_rad), near * np.cos(state.way_rad)
    across = (log_friction(x_m=left_x, y_m=left_y) - log_friction(x_m=-left_x, y_m=-left_y)) / (2.0 * near)
    lever = said("friction_patch", "lever", state, **sizes, length_m=0.011, turning=0.8)
    np.testing.assert_allclose(lever, 0.8 * state.area_m2 / 12.0 * across, atol=1e-9)
    assert np.abs(lever).max() > 1e-4


def test_a_patch_shows_a_spot_anywhere_and_waves() -> None:
    """A patch shows what rubs, stains and grinding leave: within a tenth of a spot off centre, exactly for waves."""
    x, y = (each.ravel() for each in np.meshgrid(*2 * [np.linspace(-0.03, 0.03, 25)]))
    state = at_rest(len(x), x_m=x, y_m=y, mount_rad=np.zeros_like(x))
    names = [one.name for one in catalogue()["friction_patch"].parameters if not one.is_shape]
    spot = 0.2 * np.exp(-0.5 * (np.square(x - 0.008) + np.square(y + 0.004)) / 0.012**2)
    waves = 0.2 * np.sin((x - 0.003) / 0.007) * np.cos((y + 0.002) / 0.007)
    for shape, length_m, most in ((spot, 0.010, 0.1), (waves, 0.007, 1e-6)):
        form = {"length_m": length_m, "turning": 0.0}
        terms = [np.log(said("friction_patch", "friction", state, **{name: 0.1}, **form)) for name in names]
        basis = np.column_stack([*terms, np.ones_like(x)])
        left = shape - basis @ np.linalg.lstsq(basis, shape, rcond=None)[0]
        assert np.abs(left).max() < most * np.abs(shape).max()


def test_friction_behind_the_mass_keeps_a_block_straight_and_ahead_of_it_swings_it_round() -> None:
    """A shuttlecock: turned a little off the way, the moment brings it back, or on."""
    off = 0.1
    leading = contacts(1, moving=True, way_rad=0.0, yaw_rad=off, tilt_rad=0.5)
    assert said("uneven_contact", "lever", leading, x_m=-1e-3)[0] < 0
    assert said("uneven_contact", "lever", leading, x_m=1e-3)[0] > 0


def test_friction_across_the_way_turns_with_the_other_part_of_the_arm() -> None:
    """The moment is a × F for the force as a vector, F = -(along e + across n)."""
    state, rng = contacts(30, moving=True), np.random.default_rng(7)
    arm = np.array([1e-3, -4e-4])
    effect = catalogue()["uneven_contact"]
    model = Model(mu_s=0.4, terms=(Term(effect, {**effect.neutral(), "x_m": arm[0], "y_m": arm[1]}),))
    along, across = rng.uniform(1.0, 4.0, (2, 30))
    turned = Rotation.from_euler("z", state.yaw_rad[:, None]).as_matrix()[:, :2, :2] @ arm
    toward, left = (np.column_stack([np.cos(way), np.sin(way)]) for way in (state.way_rad, state.way_rad + np.pi / 2))
    force = -(along[:, None] * toward + across[:, None] * left)
    expected = turned[:, 0] * force[:, 1] - turned[:, 1] * force[:, 0]
    np.testing.assert_allclose(model.moment(state, along, across), expected, atol=1e-15)


def test_an_uneven_contact_holds_less_across_only() -> None:
    """Loaded along the arm there is no moment; across, the limit surface gives 1 / sqrt(1 + a² / ρ²)."""
    state = at_rest(2, yaw_rad=0.0, area_m2=1e-4, way_rad=np.radians([0.0, 90.0]))
    along, across = said("uneven_contact", "friction", state, x_m=2e-3)
    assert along == pytest.approx(1.0)
    assert across == pytest.approx(1 / np.sqrt(1 + 12 * 0.2**2))


def in_foam(count: int, **fixed: Any) -> Contact:
    """Blocks of 10 g and 1 cm, square to the foam, of which one side stands 2 mm deep in it."""
    usual: dict[str, Any] = {
        "moving": True, "x_m": 0.03, "y_m": 0.0, "yaw_rad": 0.0, "area_m2": 1e-4, "mass_kg": 0.01, "border_m": -0.002,
        "way_rad": 0.0, "speed_m_s": 0.1,
    }  # fmt: skip
    return contacts(count, **(usual | fixed))


def test_foam_pushes_back_and_never_pulls() -> None:
    """Towards the centre inside it, nothing outside, nothing on a block that leaves fast."""
    state = in_foam(3, border_m=[0.03, -0.002, -0.002], way_rad=[0.0, 0.0, np.pi], speed_m_s=[0.1, 0.1, 5.0])
    push = said("border_contact", "push", state, stiffness_n_m=20.0, damping_n_s_m=0.1, lip_m=0.0)
    outward = 0.035 / np.hypot(0.035, 0.005)  # the two corners in the foam lie a little aside of the way
    np.testing.assert_allclose(push[:, 0], [0.0, -(20 * 0.002 + 0.1 * 0.1 * outward) / 0.01 * outward, 0.0], atol=1e-12)
    np.testing.assert_allclose(push[:, 1], 0.0, atol=1e-12)


def test_a_corner_in_the_foam_turns_the_block() -> None:
    """Square to the foam nothing turns it; turned a little, the corner that goes in first is pushed back."""
    state = in_foam(4, border_m=[-0.002, -0.001, -0.001, -0.001], yaw_rad=[0.0, 0.2, -0.2, 0.2])
    state = replace(state, moving=np.array([True, True, True, False]))
    spin = said("border_contact", "spin", state, stiffness_n_m=20.0, damping_n_s_m=0.0, lip_m=0.0, turning=1.0)
    assert spin[0] == pytest.approx(0.0, abs=1e-9)
    corner = 0.005 * np.array([np.cos(0.2) + np.sin(0.2), np.sin(0.2) - np.cos(0.2)])  # the outermost, to the right
    place = corner + np.array([0.03, 0.0])
    force = -0.5 * 20 * 0.001 / 0.01 * place / np.hypot(*place)
    wanted = (corner[0] * force[1] - corner[1] * force[0]) / (1e-4 / 6)
    assert spin[1:3] == pytest.approx([wanted, -wanted])
    assert spin[3] == 0.0
    half = said("border_contact", "spin", state, stiffness_n_m=20.0, damping_n_s_m=0.0, lip_m=0.0, turning=0.5)
    assert half == pytest.approx(0.5 * spin)


# --- the rig ----------------------------------------------------------------------------------------------------------


def attitude_of(state: Contact, *, tilt_rad: Array | None = None) -> Rotation:
    """World_from_plate of plates that were turned about a level axis."""
    tilt = state.tilt_rad if tilt_rad is None else tilt_rad
    return Rotation.from_rotvec(tilt[:, None] * state.tilt_axis)


def test_the_tilt_axis_makes_the_plate_descend_where_it_says() -> None:
    """Gravity seen from the plate points along `down_rad`."""
    state = at_rest(tilt_rad=0.4)
    gravity = attitude_of(state).inv().apply([0.0, 0.0, -1.0])
    np.testing.assert_allclose(np.arctan2(gravity[:, 1], gravity[:, 0]), state.down_rad, atol=1e-9)


def test_level_error_is_one_rotation_of_the_world() -> None:
    """The same in every tilt, to second order of it."""
    state = at_rest()
    turn = said("platform_level", "attitude", state, eps_x_rad=0.01, eps_y_rad=-0.02)
    true = attitude_of(state) * Rotation.from_rotvec(turn)
    error = true * attitude_of(state).inv()
    np.testing.assert_allclose(error.as_rotvec(), np.tile([0.01, -0.02, 0.0], (12, 1)), atol=1e-9)


def test_scaled_angle_is_undone() -> None:
    """Reported = (1 + g) true + b."""
    state = at_rest()
    true = (state.tilt_rad - 0.02) / 1.05
    turned = attitude_of(state) * Rotation.from_rotvec(
        said("angle_scale", "attitude", state, gain=0.05, offset_rad=0.02)
    )
    np.testing.assert_allclose(turned.as_matrix(), attitude_of(state, tilt_rad=true).as_matrix(), atol=1e-9)


def test_play_lags_on_both_sides() -> None:
    """The plate is below the report while rising, above it while falling; it is invisible without reversals."""
    state = at_rest(2, tilt_rad=0.3, rising=np.array([1.0, -1.0]), gone_rad=0.1)
    turned = attitude_of(state) * Rotation.from_rotvec(said("backlash", "attitude", state, half_width_rad=0.005))
    np.testing.assert_allclose(turned.magnitude(), [0.295, 0.305], atol=1e-9)
    assert KNOWN["backlash"].why_untestable(state) is None
    assert "reversals" in str(KNOWN["backlash"].why_untestable(at_rest(rising=1.0)))


def test_a_plate_with_play_waits_until_it_is_taken_up() -> None:
    """A play operator along the same ways gives the same, also for swings back of less than the whole play."""
    turns = [0.0, 0.3, 0.28, 0.35, 0.347, 0.349, 0.342, 0.346, 0.32, 0.36, 0.354, 0.37]
    told = np.concatenate([np.linspace(one, other, 60) for one, other in itertools.pairwise(turns)])
    plate, lies = 0.005, list[float]()
    for angle in told:
        plate = min(max(plate, angle - 0.005), angle + 0.005)
        lies.append(plate)
    rising = np.repeat(np.sign(np.diff(turns)), 60)
    turned, swing = turned_at(told, rising, before_rad=0.0)
    gone = np.abs(told - turned)
    state = at_rest(len(told), tilt_rad=told, rising=rising, gone_rad=gone, swing_rad=swing, down_rad=0.0)
    lag = said("backlash", "attitude", state, half_width_rad=0.005)
    np.testing.assert_allclose(told + lag[:, 1], lies, atol=1e-12)


def test_a_plate_with_play_moves_as_its_own_angle_does() -> None:
    """Its rate is 0 while it waits; then it takes up the arm's, and its accelerations add up to that."""
    time_s = np.linspace(0.0, 0.1, 2001)
    gone = 2.0 * time_s**2 + 0.1 * time_s
    state = at_rest(
        2001,
        tilt_rad=0.4 - gone,
        rising=-1.0,
        gone_rad=gone,
        down_rad=0.0,
        rate_rad_s=np.outer(4.0 * time_s + 0.1, [0.0, -1.0, 0.0]),
        acceleration_rad_s2=np.tile([0.0, -4.0, 0.0], (2001, 1)),
    )
    moved = said("backlash", "motion", state, half_width_rad=0.005)
    rate, acceleration = state.rate_rad_s + moved[:, 0], state.acceleration_rad_s2 + moved[:, 1]
    waits = gone < 0.01
    assert 0 < np.count_nonzero(waits) < 2001
    np.testing.assert_array_equal(rate[waits], 0.0)
    np.testing.assert_array_equal(acceleration[waits], 0.0)
    np.testing.assert_allclose(rate[-1], state.rate_rad_s[-1])
    np.testing.assert_allclose(np.trapezoid(acceleration, time_s, axis=0), rate[-1] - rate[0], rtol=1e-3, atol=1e-9)


def test_a_pivot_below_the_block_throws_it_back() -> None:
    """0.1 m below, 1 rad/s² of growing tilt about y: 0.1 m/s² against the motion, and nothing at a steady rate."""
    state = at_rest(1)
    still, spun = np.zeros((1, 3)), np.array([[0.0, 1.0, 0.0]])
    jerk = replace(state, rate_rad_s=still, acceleration_rad_s2=spun)
    np.testing.assert_allclose(said("pivot_offset", "push", jerk, z_m=0.1), [[-0.1, 0.0, 0.0]])
    steady = replace(state, rate_rad_s=spun, acceleration_rad_s2=still)
    np.testing.assert_allclose(said("pivot_offset", "push", steady, z_m=0.1), [[0.0, 0.0, 0.1]])


# --- the picture ------------------------------------------------------------------------------------------------------


def square_view(tilt_deg: Any, down_deg: Any, **fixed: Any) -> View:
    """A square 20 mm block in the middle, its sides along x and y, at rest."""
    tilt, down = np.broadcast_arrays(np.radians(tilt_deg), np.radians(down_deg))
    count = tilt.size
    shape: dict[str, Any] = {
        "tilt_rad": tilt.ravel(),
        "down_rad": down.ravel(),
        "velocity_m_s": np.zeros((count, 2)),
        "yaw_rate_rad_s": np.zeros(count),
        "point_m": [0.01 * SQUARE] * count,
    }
    return views(count, **(shape | fixed))


def test_a_cube_tips_at_45_along_an_edge_and_54_7_along_a_diagonal() -> None:
    """A flat specimen does not tip."""
    view = square_view([44.9, 46.5, 54.6, 56.2], [0.0, 90.0, 45.0, -135.0])
    fallen = np.any(said("tipping", "seen", view, slenderness=1.0) != 0, axis=(1, 2))
    assert fallen.tolist() == [False, True, False, True]
    assert np.all(said("tipping", "seen", square_view([70.0], [0.0]), slenderness=0.2) == 0)


def test_a_fallen_mark_is_seen_edge_on_beyond_its_lower_edge() -> None:
    """All of it stands at one height of the block beyond the edge that it fell over, as wide as ever."""
    view = square_view([60.0], [0.0])
    seen = view.point_m + said("tipping", "seen", view, slenderness=1.0)
    np.testing.assert_allclose(seen[0, :, 0], 0.01 + 0.02, atol=1e-12)
    np.testing.assert_allclose(seen[0, :, 1], view.point_m[0, :, 1], atol=1e-12)


def test_tipping_needs_a_steep_plate() -> None:
    """Said from the onsets alone."""
    assert "stands up to 11.3°" in str(KNOWN["tipping"].why_untestable(at_rest(tilt_rad=0.19)))
    assert KNOWN["tipping"].why_untestable(at_rest(tilt_rad=0.2)) is None


def test_the_camera_sags_for_everything_and_the_sole_for_the_block_only() -> None:
    """Fiducials are for telling the two apart."""
    fiducial = views(on_block=False)
    assert np.any(said("camera_sag", "seen", fiducial, shift_m=1e-3) != 0)
    for name, first in (("presliding", "elastic_m"), ("tipping", "slenderness")):
        assert np.all(said(name, "seen", fiducial, **{first: 1e-3}) == 0)


def test_a_sole_creeps_by_decades_down_the_slope() -> None:
    """The creep at 45° is e at once, k more after 9 s, 2 k after 99 s."""
    view = square_view([45.0] * 3, [90.0] * 3, rest_s=[0.0, 9.0, 99.0], limit_rad=math.nan)
    seen = said("presliding", "seen", view, elastic_m=1e-4, creep_m_per_decade=5e-5)
    np.testing.assert_allclose(seen[:, 0, 1], [1e-4, 1.5e-4, 2e-4])
    np.testing.assert_allclose(seen[:, :, 0], 0.0, atol=1e-12)


def test_a_sole_yields_beyond_a_share_of_its_limit() -> None:
    """Its stiffness falls to nothing at the limit: (1 - s) / (1 - b) beyond the share b, and Dahl's law where b = 0."""
    limit = math.atan(0.4)
    shares = np.linspace(0.05, 0.95, 1801)
    view = square_view(np.degrees(np.arctan(0.4 * shares)), 90.0, limit_rad=np.full(len(shares), limit))

    def shift(elastic_share: float) -> Array:
        return said("presliding", "seen", view, elastic_m=1e-3, elastic_share=elastic_share)[:, 0, 1]

    np.testing.assert_allclose(shift(1.0), 1e-3 * 0.4 * shares)
    np.testing.assert_allclose(shift(0.0), -1e-3 * 0.4 * np.log(1.0 - shares))
    stiffness = 0.4e-3 / np.gradient(shift(0.6), shares, edge_order=2)
    np.testing.assert_allclose(stiffness, np.minimum((1.0 - shares) / 0.4, 1.0), rtol=2e-3)


def test_a_sole_whose_limit_nobody_knows_is_elastic() -> None:
    view = square_view([5.0, 40.0, 45.0], 90.0, limit_rad=[math.nan, math.nan, 0.0])
    seen = said("presliding", "seen", view, elastic_m=1e-4, elastic_share=0.5)
    np.testing.assert_allclose(seen[:, 0, 1], 1e-4 * np.tan(np.radians([5.0, 40.0, 45.0])))


def test_a_moving_mark_shears_by_its_rows() -> None:
    """20 mm of a 100 mm picture read in 20 ms: 4 ms between its edges, 1.2 mm at 0.3 m/s."""
    view = square_view([20.0], [0.0], velocity_m_s=[[0.3, 0.0]], image_centre_m=[0.0, 0.0])
    seen = said("rolling_shutter", "seen", view, readout_s=0.02)
    assert seen[0, 0, 0] - seen[0, 3, 0] == pytest.approx(1.2e-3)
    np.testing.assert_allclose(seen[..., 1], 0.0, atol=1e-15)


def test_stamps_are_early_by_the_rows_that_come_before_the_optical_axis() -> None:
    """Half the read-out where the first row is stamped, none for the middle one, and the other way for the last."""
    effect = KNOWN["rolling_shutter"]
    delays = [effect.delay_s({"readout_s": 0.02, "axis_later": share}) for share in (0.5, 0.0, -0.5)]
    assert delays == [-0.01, 0.0, 0.01]
    assert effect.delay_s({"readout_s": -0.02, "axis_later": -0.5}) == -0.01  # A turned picture's last row is first.


def test_a_camera_is_pulled_down_the_slope_or_where_its_cable_pulls() -> None:
    """To opposite sides one turns with the slope, the other does not; neither acts on a level plate."""
    view = views(3, tilt_rad=np.array([0.5, 0.5, 0.0]), down_rad=np.array([0.3, 0.3 + np.pi, 0.3]))
    sag = said("camera_sag", "seen", view, shift_m=1e-3)[:, 0]
    cable = said("camera_sag", "seen", view, fixed_x_m=1e-3, fixed_y_m=-2e-3)[:, 0]
    np.testing.assert_allclose(sag[0], -sag[1], atol=1e-12)
    np.testing.assert_allclose(sag[0], 1e-3 * np.sin(0.5) * np.array([np.cos(0.3), np.sin(0.3)]))
    np.testing.assert_allclose(cable[0], cable[1])
    np.testing.assert_allclose(cable[0], np.sin(0.5) * np.array([1e-3, -2e-3]))
    assert not sag[2].any()
    assert not cable[2].any()


def test_a_turning_mark_shears_by_its_corners_own_velocity() -> None:
    """Half the picture's read-out later at 10 mm above a centre that turns: −ω y T · y / height."""
    view = square_view([20.0], [0.0], yaw_rate_rad_s=[2.0], image_centre_m=[0.0, 0.0])
    seen = said("rolling_shutter", "seen", view, readout_s=0.02)
    np.testing.assert_allclose(seen[0, 2], 0.02 * (-0.01 / 0.1) * 2.0 * np.array([-0.01, 0.01]), atol=1e-15)


def test_distortion_is_relative_at_the_edge_of_the_picture() -> None:
    """k1 at half the picture's height from the axis, an eighth of its displacement half way."""
    at = np.array([[[0.05, 0.0], [0.025, 0.0], [0.0, 0.0], [0.0, -0.05]]])
    seen = said("lens_distortion", "seen", square_view([0.0], [0.0], point_m=at, image_centre_m=[0.0, 0.0]), k1=0.02)
    np.testing.assert_allclose(seen[0], [[1e-3, 0], [1.25e-4, 0], [0, 0], [0, -1e-3]], atol=1e-15)


def test_creep_agrees_with_mujocos_formula() -> None:
    """Its defaults, four corners, 20°: (1 − d0) / d0 · dw τ / (2 n impratio) g sin θ = 0.9 mm/s."""
    time_s = (1 - 0.9) / 0.9 * 0.95 * 0.02 / (2 * 4 * 1.0)
    creep = said("solver_creep", "creep", at_rest(1, tilt_rad=np.radians(20.0)), time_s=time_s)
    assert np.linalg.norm(creep) == pytest.approx(0.885e-3, rel=1e-2)


def test_whose_stamps_are_off_shows_in_what_other_sensors_see() -> None:
    """The camera is late against the arm either way; the arm's share is all that another sensor has."""
    clock = KNOWN["clock_offset"]
    for share in (0.0, 0.4, 1.0):
        values = {"delay_s": -0.05, "of_arm": share}
        assert clock.delay_s(values) == -0.05
        assert clock.arm_delay_s(values) == pytest.approx(-0.05 * share)
