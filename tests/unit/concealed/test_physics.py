"""Each law of the generator against the page of physics: sign, size, and nothing at its null value."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.concealed.catalogue import BEYOND, EFFECTS, plant
from tests.concealed.contact import direction_law, drive, foam, nearest, speed_law
from tests.concealed.ride import presliding
from tests.concealed.session import RunRecord
from tests.concealed.view import see_mark
from tests.concealed.world import NULL, RunFacts, World
from tests.unit.concealed.sessions import MASS_KG, correlation, downhill, mu_of, mus, path_of, quiet, slid

RUN = RunFacts()


def test_a_plain_block_slips_at_the_angle_of_repose_and_follows_newton():
    session = quiet(8)
    # A block that lets go just as a step ends may rest again until the next one: 0.05° later.
    assert mus(session) == pytest.approx(NULL.mu, rel=2.5e-3)
    assert np.median(mus(session)) == pytest.approx(NULL.mu, rel=3e-4)
    for run in slid(session):
        seconds, way, tilt = path_of(run)
        done = run.ride
        fine = np.linspace(0.0, seconds[-1], 4000)
        angle = np.interp(done.truths[0] + 900.0 * fine, done.attitude_at, done.tilt)
        step = fine[1]
        rate = np.gradient(angle, step)
        speed = np.zeros_like(fine)
        for _ in range(4):  # the Coriolis force presses by the speed that is sought
            pull = 9.81 * np.sin(angle) - NULL.mu * (9.81 * np.cos(angle) - 2.0 * rate * speed)
            speed = np.concatenate([[0.0], np.cumsum(0.5 * step * (pull[1:] + pull[:-1]))])
        length = np.concatenate([[0.0], np.cumsum(0.5 * step * (speed[1:] + speed[:-1]))])
        # The rest are the forces of a plate whose turning changes, at the block's distance from the pivot.
        assert way @ downhill(run) == pytest.approx(np.interp(seconds, fine, length), abs=3e-4)
        assert tilt[-1] > done.truths[1]


@pytest.mark.parametrize("name", sorted({**EFFECTS, **BEYOND}))
def test_every_effect_vanishes_at_strength_zero(name: str):
    planted = plant((EFFECTS | BEYOND)[name], np.random.default_rng(4))
    plain, nothing = quiet(4), quiet(4, world=planted.apply(NULL, 0.0))
    for a, b in zip(plain.runs, nothing.runs, strict=True):
        np.testing.assert_array_equal(a.ride.corners_px, b.ride.corners_px)
        np.testing.assert_array_equal(a.ride.reading_tilt, b.ride.reading_tilt)


@pytest.mark.parametrize("name", sorted({**EFFECTS, **BEYOND}))
def test_every_effect_shows_at_its_cap(name: str):
    effect = (EFFECTS | BEYOND)[name]
    needs: dict[str, dict[str, Any]] = {"border": {"min_slide_px": 20.0}, "masses": {"masses": (0.5, 1.0, 2.0)}}
    design = {key: value for need in effect.needs for key, value in needs.get(need, {}).items()}
    small = NULL._replace(wall_radius=0.024) if "border" in effect.needs else NULL
    planted = plant(effect, np.random.default_rng(4))
    plain, strong = quiet(12, world=small, **design), quiet(12, world=planted.apply(small, 0.5 * effect.cap), **design)
    differ = [
        len(a.ride.frame_at) != len(b.ride.frame_at)
        or not np.array_equal(a.ride.corners_px, b.ride.corners_px)
        or not np.array_equal(a.ride.reading_tilt, b.ride.reading_tilt)
        for a, b in zip(plain.runs, strong.runs, strict=True)
    ]
    # A clock's offset moves the stamps and nothing else.
    assert any(differ) or name == "clock_offset"


def test_friction_never_drives_a_sliding_block():
    rng = np.random.default_rng(2)
    for name in ("object_anisotropy", "plate_anisotropy", "one_way_friction"):
        world = plant(EFFECTS[name], rng).apply(NULL, EFFECTS[name].cap)
        for _ in range(200):
            px, py = rng.normal(0.0, 20.0, 2)
            hx, hy = nearest(world, RUN, 0.3, 3.5, px, py)
            assert hx * (px - hx) + hy * (py - hy) >= -1e-9


def test_friction_is_the_nearest_point_of_its_set():
    rng = np.random.default_rng(3)
    world = NULL._replace(grain_plate=0.6, grain_plate_axis=0.4, nap_object=0.1)
    angles = np.linspace(0.0, 2.0 * math.pi, 20_000)
    edge = np.array([3.5 * direction_law(world, RUN, angle, 0.2) for angle in angles])
    for _ in range(20):
        px, py = rng.normal(0.0, 1.0, 2) * 30.0
        hx, hy = nearest(world, RUN, 0.2, 3.5, px, py)
        best = np.hypot(px - edge * np.cos(angles), py - edge * np.sin(angles)).min()
        assert math.hypot(px - hx, py - hy) <= best + 1e-4


# --- contact ----------------------------------------------------------------------------------------------------------


def early_growth(world: World = NULL) -> float:
    """Returns how much the way grows when the time since the onset doubles: 8 for t³, 4 for t²."""
    ratios = []
    for run in slid(quiet(8, world=world, wide_steps=1, wide_deg=30.0)):
        seconds, way, _ = path_of(run)
        length = way @ downhill(run)
        ratios.append(np.interp(0.09, seconds, length) / np.interp(0.045, seconds, length))
    return float(np.median(ratios))


def test_kinetic_drop_makes_the_way_grow_as_the_square_of_time():
    assert early_growth() == pytest.approx(8.0, abs=0.3)
    assert early_growth(NULL._replace(drop=0.3)) == pytest.approx(4.0, abs=0.5)


def test_speed_laws_have_their_signs_and_limits():
    for shape in (0.0, 1.0):
        falling = NULL._replace(fall=0.2, fall_speed=0.02, fall_shape=shape)
        values = [speed_law(falling, speed) for speed in (0.0, 0.01, 0.05, 5.0)]
        assert values[0] == 1.0
        assert values == sorted(values, reverse=True)
        assert values[-1] == pytest.approx(0.8, abs=1e-3)
    rising = NULL._replace(rate_gain=0.02, rate_speed=1e-3)
    assert speed_law(rising, 0.1 * math.e) - speed_law(rising, 0.1) == pytest.approx(0.02, rel=0.02)


def test_viscous_drag_slows_in_proportion_to_speed():
    plain, slowed = quiet(6), quiet(6, world=NULL._replace(drag_per_s=4.0))
    for a, b in zip(slid(plain)[:1], slid(slowed)[:1], strict=True):
        (ta, wa, _), (tb, wb, _) = path_of(a), path_of(b)
        assert np.interp(0.25, tb, wb @ downhill(b)) < 0.9 * np.interp(0.25, ta, wa @ downhill(a))


@pytest.mark.parametrize("shape", [0.0, 1.0])
def test_ageing_raises_the_onset_by_its_share_per_decade(shape: float):
    world = NULL._replace(ageing=0.05, ageing_shape=shape, ageing_cutoff_s=0.01)
    session = quiet(30, world=world, dwell_s=(0.3, 20.0))
    ages = [math.log10((run.ride.truths[0] - run.rest_at) / 900.0) for run in slid(session)]
    assert np.polyfit(ages, mus(session) / NULL.mu, 1)[0] == pytest.approx(0.05, rel=0.15)


@pytest.mark.parametrize(("shape", "end"), [(0.0, 1.0 - 0.2 * (1.0 - math.exp(-29 / 20))), (1.0, 1.0 - 0.2 * 29 / 20)])
def test_wear_lowers_friction_run_by_run(shape: float, end: float):
    session = quiet(30, world=NULL._replace(wear=0.2, wear_runs=20.0, wear_shape=shape))
    values = mus(session)
    assert (np.diff(values) < 1e-3).all()
    assert values[0] == pytest.approx(NULL.mu, rel=3e-3)
    assert values[-1] / NULL.mu == pytest.approx(end, abs=2e-3)


@pytest.mark.parametrize("shape", [0.0, 1.0])
def test_grain_of_the_plate_is_a_second_harmonic_of_direction_that_turns_with_the_mount(shape: float):
    world = NULL._replace(grain_plate=0.4, grain_plate_axis=0.0, grain_plate_shape=shape)
    by_direction = {run.direction: mu_of(run) for run in slid(quiet(30, world=world))}
    # Direction 0 slides along −y, direction 1 along +x: the axis of high friction.
    assert math.log(by_direction[1] / by_direction[0]) == pytest.approx(0.4, abs=0.01)
    assert by_direction[1] == pytest.approx(by_direction[3], rel=1e-3)
    turned = {run.direction: mu_of(run) for run in slid(quiet(30, world=world, mounts_deg=(90.0,)))}
    assert math.log(turned[0] / turned[1]) == pytest.approx(0.4, abs=0.01)


def test_a_block_on_grain_slides_off_the_steepest_line_towards_low_friction():
    world = NULL._replace(grain_plate=0.5, grain_plate_axis=math.radians(45.0))
    for run in slid(quiet(12, world=world)):
        _, way, _ = path_of(run)
        low = np.array([math.cos(math.radians(135.0)), math.sin(math.radians(135.0))])
        low *= math.copysign(1.0, float(low @ downhill(run)))
        course = way[-1] / np.hypot(*way[-1])
        assert course @ low > downhill(run) @ low + 0.05


def test_grain_of_the_block_turns_with_its_yaw():
    world = NULL._replace(grain_object=0.4)
    session = quiet(40, world=world, handled_every=2, yaw_varies=True)
    runs = slid(session)
    angle = [math.atan2(*downhill(run)[::-1]) - run.start[2] for run in runs]
    assert correlation(np.cos(2.0 * np.array(angle)), np.log(mus(session))) > 0.99


def test_nap_is_a_first_harmonic_that_turns_with_the_mount_and_a_level_error_is_one_that_does_not():
    for mount, sign in ((0.0, 1.0), (180.0, -1.0)):
        nap = {r.direction: mu_of(r) for r in slid(quiet(30, world=NULL._replace(nap_plate=0.1), mounts_deg=(mount,)))}
        assert sign * (nap[1] - nap[3]) / (2.0 * NULL.mu) == pytest.approx(0.1, abs=2e-3)
        level = NULL._replace(level_x=0.02)
        off = {r.direction: r.ride.truths[1] for r in slid(quiet(30, world=level, mounts_deg=(mount,)))}
        # Already leaning towards +x by 0.02 rad, the plate needs that much less tilt in direction 1.
        assert (off[3] - off[1]) / 2.0 == pytest.approx(0.02, abs=1e-3)


def test_a_patch_changes_friction_where_it_is():
    world = NULL._replace(patch=0.3, patch_x=0.01, patch_radius=0.008)
    session = quiet(60, world=world, handled_every=1)
    near = [math.exp(-0.5 * ((run.start[0] - 0.01) ** 2 + run.start[1] ** 2) / 0.008**2) for run in slid(session)]
    assert np.polyfit(near, mus(session) / NULL.mu, 1) == pytest.approx([0.3, 1.0], abs=0.01)


def test_adhesion_and_load_follow_their_formulas():
    masses = (0.5, 1.0, 2.0)
    for run in slid(quiet(24, world=NULL._replace(adhesion_n=0.01), masses=masses)):
        theta = run.ride.truths[1]
        expected = NULL.mu * (1.0 + 0.01 / (run.facts.mass * 9.81 * math.cos(theta)))
        assert math.tan(theta) == pytest.approx(expected, rel=1e-2)
    world = NULL._replace(load_power=0.2, load_reference_n=MASS_KG * 9.81)
    for run in slid(quiet(24, world=world, masses=masses)):
        theta = run.ride.truths[1]
        pressed = run.facts.mass * 9.81 * math.cos(theta)
        assert math.tan(theta) / NULL.mu == pytest.approx((pressed / (MASS_KG * 9.81)) ** -0.2, rel=1e-2)


@pytest.mark.parametrize("shape", [0.0, 1.0])
def test_presliding_grows_with_the_load_and_is_seen_before_the_slip(shape: float):
    world = NULL._replace(presliding_m=3e-4, presliding_shape=shape)
    loads = [presliding(world, load, 2.0) for load in (0.0, 0.3, 0.6, 0.9, 1.0)]
    assert loads[0] == 0.0
    assert loads == sorted(loads)
    for run in slid(quiet(6, world=world)):
        done = run.ride
        still = (done.frame_at > done.marks[0]) & (done.frame_at < done.truths[0])
        moved = (done.corners_px[still][-1] - done.corners_px[still][0]).reshape(4, 2).mean(axis=0)
        assert moved @ (downhill(run) * [1.0, -1.0]) > 0.5


def test_a_block_with_an_uneven_contact_turns_and_slips_early_across_it():
    plain, offset = quiet(20), quiet(20, world=NULL._replace(uneven_x=0.001))
    assert max(abs(run.ride.pose[2] - run.start[2]) for run in plain.runs) == 0.0
    turns = [run.ride.pose[2] - run.start[2] for run in slid(offset) if run.direction in (0, 2)]
    assert np.median(np.abs(turns)) > math.radians(0.5)
    for run in slid(offset)[:1]:
        if run.direction in (0, 2):
            assert mu_of(run) / NULL.mu == pytest.approx(1.0 / math.hypot(1.0, 0.1 * math.sqrt(12.0)), rel=2e-3)


@pytest.mark.parametrize("axis", [0.0, 2.0, math.pi, -1.5])
def test_a_block_with_an_uneven_contact_is_let_go_in_the_direction_of_its_pull(axis: float):
    nap = NULL._replace(nap_plate=0.15, nap_plate_axis=axis)
    plain, offset = quiet(24, world=nap), quiet(24, world=nap._replace(uneven_x=1e-7))
    expected = {run.direction: mu_of(run) for run in slid(plain)}
    for run in slid(offset):
        if run.direction in expected:  # the sessions go different ways
            assert mu_of(run) == pytest.approx(expected[run.direction], rel=0.01)
    assert max(expected.values()) > 1.15 * min(expected.values())


def test_the_foam_pushes_inwards_near_the_border_only():
    world = NULL._replace(foam_per_s2=1000.0)
    edge = world.wall_radius - world.foam_width
    assert foam(world, edge - 1e-4, 0.0, 1.0, 0.0) == (0.0, 0.0)
    x, y = foam(world, edge + 1e-3, 0.0, 0.0, 0.0)
    assert (x, y) == (pytest.approx(-1.0), 0.0)
    assert foam(world, edge + 1e-3, 0.0, -10.0, 0.0) == (0.0, 0.0)  # it never pulls


def test_a_tall_block_tips_over_and_is_not_taken_for_sliding():
    session = quiet(10, world=NULL._replace(tips_at=0.3, mark_height=0.03))
    assert all(run.ride.tipped and run.censored for run in session.runs)
    assert all(run.ride.tips.any() for run in session.runs)


# --- rig and camera ---------------------------------------------------------------------------------------------------


def test_angle_scale_is_absorbed_by_mu_but_not_by_another_sensor():
    session = quiet(8, world=NULL._replace(scale=0.05))
    for run in slid(session):
        assert math.tan(run.ride.truths[1] / 1.05) == pytest.approx(NULL.mu, rel=6e-3)
        reported = np.interp(run.ride.reading_at, run.ride.attitude_at, run.ride.tilt)
        steep = reported > 0.1
        assert np.median(reported[steep] / run.ride.reading_tilt[steep]) == pytest.approx(1.05, abs=2e-3)


def test_backlash_lags_on_the_way_up_and_the_other_way_on_the_way_down():
    run = slid(quiet(4, world=NULL._replace(play=0.01)))[0]
    reported = np.interp(run.ride.reading_at, run.ride.attitude_at, run.ride.tilt)
    lag = reported - run.ride.reading_tilt
    up = (run.ride.reading_at > run.ride.marks[0] + 400) & (run.ride.reading_at < run.ride.marks[1])
    assert lag[up] == pytest.approx(0.005, abs=5e-4)
    assert lag[run.ride.reading_at > run.ride.marks[3]] == pytest.approx(-0.005, abs=5e-4)


def test_a_pivot_above_the_block_pulls_it_downhill_when_a_step_begins():
    above = NULL._replace(pivot_height=-0.05)
    down = np.array([0.0, -1.0])
    speeding, still = (0.0, 2.0), np.zeros(3)
    pulls = [drive(world, RUN, 0.0, 0.0, 0.3, speeding, 0.0, still)[:2] for world in (above, NULL)]
    extra = np.subtract(pulls[0], pulls[1])
    assert extra @ down == pytest.approx(0.1)
    # 0.1 m/s² is worth 0.6° (a / g).
    assert math.degrees(extra @ down / 9.81) == pytest.approx(0.58, abs=0.01)


def test_vibration_makes_slips_early_in_some_poses_of_the_arm():
    session = quiet(60, world=NULL._replace(shake=0.5, shake_axis=0.0, shake_hz=3.0))
    early = {d: np.mean([NULL.mu - mu_of(r) for r in slid(session) if r.direction == d]) for d in (0, 2)}
    assert early[0] > 0.01
    assert abs(early[2]) < 1e-3


def test_the_camera_sinks_along_gravity_so_that_all_it_sees_moves_uphill():
    run = slid(quiet(4, world=NULL._replace(sag_px=10.0)))[0]
    done = run.ride
    still = (done.frame_at > done.marks[0]) & (done.frame_at < done.truths[0])
    moved = (done.corners_px[still] - done.corners_px[0]).reshape(-1, 4, 2).mean(axis=1)
    tilt = np.interp(done.frame_at[still], done.attitude_at, done.tilt)
    assert moved @ (downhill(run) * [1.0, -1.0]) == pytest.approx(-10.0 * np.sin(tilt), abs=1e-2)


def test_the_lens_enlarges_what_is_far_from_the_centre():
    sizes = []
    for x in (0.0, 0.025):
        corners = np.zeros(8)
        see_mark(NULL._replace(lens=0.02), np.array([x, 0.0, 0.0]), np.zeros(3), np.zeros(3), 0.0, 0.0, corners)
        sizes.append(corners[5] - corners[3])
    assert sizes[1] / sizes[0] == pytest.approx(1.0 + 0.02 * (0.5 * 6000 * 0.05 / 300 * 30 / 29) ** 2, rel=2e-3)


def test_a_rolling_shutter_shears_a_moving_mark_by_speed_times_row():
    still, moving = np.zeros(8), np.zeros(8)
    world = NULL._replace(readout_s=0.016)
    see_mark(NULL, np.zeros(3), np.zeros(3), np.zeros(3), 0.0, 0.0, still)
    see_mark(world, np.zeros(3), np.array([0.3, 0.0, 0.0]), np.zeros(3), 0.0, 0.0, moving)
    rows = still[1::2] / 600.0 * 0.016
    assert (moving - still)[0::2] == pytest.approx(0.3 * rows * 6000.0 * 30.0 / 29.0, rel=1e-6)


def test_a_rolling_shutter_sees_each_corner_in_the_row_where_it_then_is():
    """A mark moves down the image and speeds up: each corner's row is read when the corner is there."""
    seen, still = np.zeros(8), np.zeros(8)
    world, speed, gain = NULL._replace(readout_s=0.03), np.array([0.05, -0.4, 0.0]), np.array([0.5, -3.0, 0.0])
    see_mark(world, np.zeros(3), speed, gain, 0.0, 0.0, seen)
    for corner in range(4):
        wait = 0.03 * seen[2 * corner + 1] / 600.0
        moved = wait * speed + 0.5 * wait**2 * gain
        see_mark(NULL, moved, np.zeros(3), np.zeros(3), 0.0, 0.0, still)
        assert seen[2 * corner : 2 * corner + 2] == pytest.approx(still[2 * corner : 2 * corner + 2], abs=1e-3)


# --- in no catalogue --------------------------------------------------------------------------------------------------


BEYOND_LAWS: list[tuple[dict[str, float], Callable[[RunRecord], float]]] = [
    ({"damp": 0.2}, lambda run: run.facts.humidity),
    ({"echo_length": 0.1}, lambda run: run.facts.previous_length),
    ({"charge": 0.3}, lambda run: 1.0 - math.exp(-run.facts.slides_since_handled / 8.0)),
    ({"tide": 0.1, "tide_s": 100.0}, lambda run: math.sin(2.0 * math.pi * run.ride.truths[0] / 900.0 / 100.0)),
    ({"bend_per_m": 6.0}, lambda run: -float(run.start[:2] @ downhill(run))),
    ({"fourfold": 0.05}, lambda run: math.cos(4.0 * math.atan2(*downhill(run)[::-1]))),
]


@pytest.mark.parametrize(("change", "covariate"), BEYOND_LAWS)
def test_effects_beyond_the_catalogue_follow_their_covariates(
    change: dict[str, float], covariate: Callable[[RunRecord], float]
):
    session = quiet(40, world=NULL._replace(**change), handled_every=4, free=True)
    assert correlation([covariate(run) for run in slid(session)], mus(session)) > 0.9


def test_sessions_bias_themselves():
    session = quiet(80)
    pairs = list(zip(session.runs[:-1], session.runs[1:], strict=True))
    for before, after in pairs:
        np.testing.assert_array_equal(before.ride.pose, after.start)
    # Slides begin uphill of the centre, where the last one ended.
    assert np.mean([run.start[:2] @ downhill(run) for run in session.runs]) < -0.002


def test_scatter_is_what_was_asked_for():
    values = np.log(mus(quiet(150, scatter=0.1)))
    assert values.std() == pytest.approx(0.1, abs=0.02)


def test_the_same_seed_gives_the_same_session():
    a, b = quiet(6, seed=5), quiet(6, seed=5)
    for one, other in zip(a.runs, b.runs, strict=True):
        np.testing.assert_array_equal(one.ride.corners_px, other.ride.corners_px)
