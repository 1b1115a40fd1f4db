"""The patch world obeys the physics that it claims, by values that are known without it."""

import math

import numpy as np
import pytest

from tests.proof.patch_world import integrator as eq
from tests.proof.patch_world import places as at
from tests.proof.patch_world.bench import TICK_S, Bench
from tests.proof.patch_world.camera import SIZE_PX, View
from tests.proof.patch_world.draws import run_draw
from tests.proof.patch_world.effects import EFFECTS, OUTSIDE
from tests.proof.patch_world.pilot import pilot_runs, sizes
from tests.proof.patch_world.sensors import attitude
from tests.proof.patch_world.world import Camera, Contact, Patch, Scatter, Sensing, World

STILL = World(scatter=Scatter(run_sd=0.0))
G = 9.81


def bench_of(world: World = STILL, *, azimuth: float = 0.0, step_s: float = TICK_S) -> Bench:
    bench = Bench(world, step_s=step_s)
    bench.begin_run(run_draw(world, seed=1, run=1), run=1, azimuth=azimuth, before=None)
    bench.motion[at.AZIMUTH] = azimuth
    return bench


def moved(bench: Bench) -> float:
    return math.hypot(bench.state[at.X], bench.state[at.Y])


def sliding(world: World, *, speed: float, height: float = 1e-6) -> Bench:
    bench = bench_of(World(contact=world.contact._replace(height=height), patch=world.patch, scatter=world.scatter))
    bench.state[[at.VX, at.HELD]] = speed, 0.0
    return bench


@pytest.mark.parametrize("azimuth", [0.0, 0.7, 4.0])
def test_the_block_slips_at_the_friction_angle(azimuth: float) -> None:
    """A millimetre later it is where gravity less mu, from the moment of atan(mu) on, and its give have brought it."""
    bench, mu = bench_of(azimuth=azimuth), STILL.contact.mu
    end = bench.ask(math.radians(30.0), azimuth=azimuth, rate=math.radians(2.0))
    slid = speed = tilt = 0.0
    while moved(bench) < 1e-3:
        assert bench.time_s < end
        bench.advance(round(bench.time_s + 1e-3, 4))
        tilt = bench.state[at.ANGLE]
        speed += 1e-3 * max(G * (math.sin(tilt) - mu * math.cos(tilt)), 0.0)
        slid += 1e-3 * speed
    # The onset that this is late by: 6 x / (g w²) is the cube of the time since.
    late = (6 * np.array([moved(bench), slid]) * math.cos(tilt) / (G * bench.state[at.RATE])) ** (1 / 3)
    assert np.degrees(bench.state[at.RATE] * (late[0] - late[1])) == pytest.approx(0.0, abs=0.02)
    assert bench.state[at.X] * math.cos(azimuth) + bench.state[at.Y] * math.sin(azimuth) == pytest.approx(0, abs=1e-6)
    assert bench.state[at.X] * math.sin(azimuth) - bench.state[at.Y] * math.cos(azimuth) > 0


def test_the_slide_accelerates_as_gravity_and_friction_say() -> None:
    bench = bench_of()
    bench.advance(bench.time_s)
    bench.state[[at.HELD, at.VY]] = 0.0, -1e-3
    tilt = math.radians(25.0)
    bench.state[[at.ANGLE, at.SEEN, at.PLAY]] = tilt
    bench.motion[[at.POLYNOMIAL, at.LASTS]] = tilt, 0.0
    bench.advance(0.05)
    before = bench.state[at.VY]
    bench.advance(0.15)
    expected = G * (math.sin(tilt) - STILL.contact.mu * math.cos(tilt))
    assert (before - bench.state[at.VY]) / 0.1 == pytest.approx(expected, rel=2e-3)


def test_no_energy_comes_from_nowhere() -> None:
    """A block that is flung over the level plate, turning, and into the foam, only ever loses energy."""
    bench = bench_of(World(scatter=Scatter(run_sd=0.0, sole_sd=0.1, pressure_sd=0.3)))
    bench.place(0.02, 0.0)
    bench.state[[at.VX, at.VY, at.SPIN, at.HELD]] = 0.6, 0.1, 3.0, 0.0
    c, energies = STILL.contact, list[float]()
    inertia = (c.half_x**2 + c.half_y**2) / 3
    while bench.time_s < 2.0:
        bench.advance(round(bench.time_s + 1e-3, 4))
        s = bench.state
        energies.append(0.5 * (s[at.VX] ** 2 + s[at.VY] ** 2 + inertia * s[at.SPIN] ** 2))
    stored = 0.5 * G * c.mu**2 / c.stiffness  # the most that the bristles can give back
    foam = 0.5 * c.wall_stiffness * 1.2e-2**2 / c.mass
    assert max(np.diff(energies)) < stored + c.wall_return * foam
    assert energies[-1] < 1e-9
    assert 0.02 < moved(bench) < c.wall_radius


def test_an_uneven_sole_turns_the_block_as_the_sum_over_it_says() -> None:
    """With friction mu (1 + k y/b) and motion along x the moment is mu N k <y²>/b."""
    bench = sliding(World(scatter=Scatter(run_sd=0.0), patch=Patch(lopsided=(0.0, 0.2))), speed=2.0)
    bench.place(-0.02, 0.0)
    bench.advance(0.005)
    start = bench.state[at.SPIN]
    bench.advance(0.010)
    c = STILL.contact
    mean_square = c.half_y**2 * (6**2 - 1) / (3 * 6**2)
    per_mass = c.mu * G * 0.2 * mean_square / c.half_y
    expected = per_mass / ((c.half_x**2 + c.half_y**2) / 3)
    assert (bench.state[at.SPIN] - start) / 0.005 == pytest.approx(expected, rel=0.02)


def test_the_pressure_balances_the_overturning_moment() -> None:
    draw = run_draw(World(scatter=Scatter(pressure_sd=0.3)), seed=4, run=1)
    out, sole = np.zeros(len(draw.sole.points)), draw.sole
    pull = np.array([1.1e-3, -0.7e-3])
    balance = eq.balance_of(sole.points, sole.share)
    eq.pressures(pull[0], pull[1], 0.0, sole.points, sole.share, balance, out)
    assert out.sum() == pytest.approx(1.0)
    assert out @ sole.points == pytest.approx(pull, abs=1e-9)


def test_a_shifted_pressure_alone_turns_nothing() -> None:
    """Under uniform friction the resultant passes under the mass, however high that is (Coulomb's law is linear)."""
    bench = sliding(STILL, speed=0.3, height=0.008)
    bench.advance(0.05)
    assert abs(bench.state[at.SPIN]) < 1e-6


def test_halving_the_step_converges() -> None:
    """The error of a slide is of first order in the step, and 3 in 1000 of the slide at the one in use."""
    places: list[float] = []
    for step in (TICK_S, TICK_S / 2, TICK_S / 4):
        bench = bench_of(step_s=step)
        bench.ask(math.radians(30.0), azimuth=0.0, rate=math.radians(8.0))
        while bench.time_s < 3.2:
            bench.advance(round(bench.time_s + 0.01, 4))
        places.append(moved(bench))
    assert 5e-3 < places[0] < 3e-2
    first, second = abs(places[1] - places[0]), abs(places[2] - places[1])
    assert second < 0.7 * first
    assert 2 * first < 3e-3 * places[0]


@pytest.mark.parametrize("rate_filter", [0.0, 0.04])
def test_the_attitude_is_stamped_when_it_was_so(rate_filter: float) -> None:
    """With a mast that bends, the fiducial's pixels regress on the reported attitude with a lag below 0.2 ms."""
    contact = Contact(rate_filter=rate_filter)
    world = World(contact=contact, sensing=Sensing(noise_rad=0.0, rate_noise_rad_s=0.0), camera=Camera(bend_px=10.0))
    bench, view = bench_of(world), View(world.camera, 0.01, 0.008)
    rng, rows = np.random.default_rng(1), list[tuple[float, float, float]]()
    for target in (2.0, 4.0, 6.0):
        end = bench.ask(math.radians(target), azimuth=0.0, rate=math.radians(8.0))
        while bench.time_s < end + 0.2:
            bench.advance(round(bench.time_s + 0.0111, 4))
            tilt = 2 * math.asin(attitude(bench, world.sensing, (0, 0, 0), stamp_ns=0, rng=rng).qx)
            rows.append((view.fiducial(bench.state, azimuth=0.0, run=1)[1], math.sin(tilt), bench.state[at.RATE]))
    seen, sine, speed = np.array(rows).T
    shift, late, _ = np.linalg.lstsq(np.column_stack([sine, speed, np.ones_like(sine)]), seen, rcond=None)[0]
    assert abs(late / shift) < 2e-4


def test_a_corner_is_seen_in_the_row_in_which_it_stands_when_that_row_is_read() -> None:
    state, camera = np.zeros(at.SIZE), Camera(readout_s=0.02)
    state[[at.X, at.Y, at.YAW, at.VX, at.VY, at.SPIN]] = 0.01, 0.02, 0.3, 0.05, -0.3, 2.0
    state[[at.AX, at.AY, at.TURNING]] = 4.0, 3.0, 20.0
    seen = View(camera, 0.01, 0.008).block(state, azimuth=0.0, run=1)
    for corner in range(4):
        late, then = camera.readout_s * (seen[2 * corner + 1] / SIZE_PX - 0.5), state.copy()
        then[[at.X, at.Y]] += late * state[[at.VX, at.VY]] + 0.5 * late**2 * state[[at.AX, at.AY]]
        then[at.YAW] += late * state[at.SPIN] + 0.5 * late**2 * state[at.TURNING]
        there = View(Camera(), 0.01, 0.008).block(then, azimuth=0.0, run=1)
        # Its turn within 5 ms bends its path by less than a micrometre more: a hundredth of a pixel.
        assert seen[2 * corner : 2 * corner + 2] == pytest.approx(there[2 * corner : 2 * corner + 2], abs=0.01)


def test_a_sliding_block_gains_speed_as_its_state_says() -> None:
    """The gain is compared with differences of its velocity: rows that are read later see where it will be."""
    bench = bench_of(World())
    end = bench.ask(math.radians(35.0), azimuth=0.0, rate=math.radians(8.0))
    rows: list[list[float]] = []
    while bench.time_s < end and len(rows) < 40:
        bench.advance(round(bench.time_s + 0.002, 4))
        if math.hypot(bench.state[at.VX], bench.state[at.VY]) > 0.02:
            rows.append([float(bench.state[k]) for k in (at.VX, at.VY, at.AX, at.AY)])
    vx, vy, ax, ay = np.array(rows).T
    assert len(rows) == 40
    for speed, gain in ((vx, ax), (vy, ay)):
        assert np.gradient(speed, 0.002)[2:-2] == pytest.approx(gain[2:-2], abs=0.05 * np.abs(np.hypot(ax, ay)).max())


@pytest.mark.parametrize("name", sorted(set(EFFECTS) - {"soft_sole"}))
def test_an_effect_vanishes_with_its_strength(name: str) -> None:
    effect = EFFECTS[name]
    plain = World(scatter=Scatter(run_sd=0.02))
    changed = effect.change(plain, 1e-6 * effect.most, np.random.default_rng(3))
    one, other = (pilot_runs(world, seed=5, runs=60, count=1) for world in (changed, plain))
    # A grain moves the load even where it takes no friction.
    assert max(sizes(plain, one, other).values()) < (0.1 if name != "dust_grain" else 2.0)


def test_there_are_as_many_effects_as_promised() -> None:
    assert len(EFFECTS) >= 20
    assert len(OUTSIDE) >= 6
