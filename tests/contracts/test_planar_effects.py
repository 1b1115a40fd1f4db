"""Every effect that is found, in the planar simulator: it runs, vanishes at its null, and leaves what it should."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.physics.catalogue import catalogue
from station.physics.contact import Array
from station.physics.model import Model, Term
from station.simulators.planar.commands import Commands, ramps, tracks
from station.simulators.planar.simulate import ONSET_M, Chances, Motions, simulate

EFFECTS = catalogue()
MU = 0.36
STAMPS = np.arange(0.0, 3.0, 0.02)


def model(name: str, **values: float) -> Model:
    """The effect at its typical size, with some values of one's own; the others at their null."""
    effect = EFFECTS[name]
    chosen = {own.name: own.typical for own in effect.parameters}
    if values:
        chosen = {own.name: values.get(own.name, own.neutral) for own in effect.parameters}
    return Model(mu_s=MU, terms=(Term(effect, chosen),))


def steep(count: int = 8, *, top_s: float = 2.5, **circumstances: object) -> Commands:
    """Ramps of 6.9 °/s to 31.5° and back, down which every usual block slides; in all directions."""
    directions = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False) + 0.1
    return ramps((0.0, top_s, 1.2 * top_s), (0.25, 0.55, 0.1), downhill_rad=directions, **circumstances)  # pyright: ignore[reportArgumentType] (one of several kinds of array)


def run(commands: Commands, of: Model) -> Motions:
    chances = Chances(friction=np.ones(len(commands)), shake=np.linspace(-1.0, 1.0, len(commands)))
    return simulate(commands, of, time_s=STAMPS, chances=chances)


@pytest.mark.parametrize("name", EFFECTS)
def test_it_can_be_simulated_at_its_bounds(name: str) -> None:
    """Eight times as fast: a block that creeps stops and goes a thousand times a second, and each time is computed."""
    for bound in ("low", "high"):
        values = {own.name: float(getattr(own, bound)) for own in EFFECTS[name].parameters}
        motions = run(steep(top_s=0.3125), model(name, **values))
        assert np.isfinite(motions.path).all()
        slid = np.linalg.norm(motions.pose[:, :2], axis=1) > ONSET_M
        assert np.isfinite(motions.onset_rad[slid]).all() or EFFECTS[name].acts_through() & {"creep"}


@pytest.mark.parametrize("name", EFFECTS)
def test_at_its_null_nothing_differs_by_a_bit(name: str) -> None:
    effect = EFFECTS[name]
    shapes = {own.name: own.typical for own in effect.parameters if own.is_shape}
    nulls = {own.name: own.neutral for own in effect.parameters if not own.is_shape}
    plain, null = run(steep(), Model(mu_s=MU)), run(steep(), model(name, **shapes, **nulls))
    assert np.array_equal(plain.path, null.path)
    assert np.array_equal(plain.onset_s, null.onset_s)
    assert np.array_equal(plain.onset_rad, null.onset_rad)


@pytest.mark.parametrize("name", EFFECTS)
def test_it_changes_what_it_acts_through(name: str) -> None:
    effect = EFFECTS[name]
    commands, of = steep(border_m=0.02), model(name)
    if name == "pivot_offset":
        commands = stepped()
    plain, changed = run(commands, Model(mu_s=MU)), run(commands, of)
    if effect.acts_through() <= {"seen", "mass"}:
        assert np.array_equal(plain.path, changed.path)
    else:
        assert np.abs(plain.path - changed.path).max() > 1e-7


# --- the signs of their signatures ----------------------------------------------------------------------------------


def stepped() -> Commands:
    """A staircase with smooth steps, as an arm makes them: 15 steps of 2° in 0.2 s each."""
    times = np.arange(0.0, 6.0, 0.005)
    phase = np.clip(np.mod(times, 0.4) / 0.2, 0.0, 1.0)
    smooth = phase * phase * (3.0 - 2.0 * phase)
    angles = np.radians(2.0) * (np.floor(times / 0.4) + smooth)
    down = np.column_stack([np.sin(angles), np.zeros_like(angles), -np.cos(angles)])
    return tracks([times], [down])


def onsets(commands: Commands, of: Model) -> Array:
    return np.degrees(simulate(commands, of).onset_rad)


def slow(**circumstances: object) -> Commands:
    return ramps((0.0, 30.0), (0.0, 0.5), **circumstances)  # pyright: ignore[reportArgumentType] (one of several kinds of array)


def test_wear_lets_later_runs_slip_earlier() -> None:
    found = onsets(slow(run=[0.0, 20.0, 100.0]), model("wear"))
    assert found[0] > found[1] > found[2]


def test_ageing_lets_rested_blocks_hold_longer() -> None:
    found = onsets(slow(rest_s=[1.0, 100.0, 10_000.0]), model("contact_aging"))
    assert found[0] < found[1] < found[2]


def test_adhesion_holds_light_blocks_longer() -> None:
    effect = EFFECTS["adhesion"].parameters[0]
    found = onsets(slow(mass_kg=[1.0, 0.1, 0.05]), model("adhesion", **{effect.name: 0.05}))
    assert found[0] < found[1] < found[2]
    assert found[0] > math.degrees(math.atan(MU))


def test_load_dependence_lets_heavy_blocks_slip_earlier() -> None:
    found = onsets(slow(mass_kg=[0.001, 0.01, 0.1]), model("load_dependence"))
    assert found[0] > found[1] > found[2]


def test_kinetic_drop_lets_blocks_slide_farther_but_not_earlier() -> None:
    plain, dropped = run(steep(), Model(mu_s=MU)), run(steep(), model("kinetic_drop"))
    assert np.allclose(plain.onset_rad, dropped.onset_rad)
    assert (np.linalg.norm(dropped.pose[:, :2], axis=1) > np.linalg.norm(plain.pose[:, :2], axis=1)).all()


@pytest.mark.parametrize("name", ["viscous", "rate_strengthening"])
def test_friction_that_grows_with_speed_shortens_the_slide(name: str) -> None:
    effect = EFFECTS[name]
    size = next(own for own in effect.parameters if not own.is_shape)
    shapes = {own.name: own.starts[0] for own in effect.parameters if own.is_shape}
    shorter = run(steep(), model(name, **shapes, **{size.name: size.typical}))
    plain = run(steep(), Model(mu_s=MU))
    fast = np.linalg.norm(plain.pose[:, :2], axis=1) > 0.05
    assert fast.any()
    assert (np.linalg.norm(shorter.pose, axis=1) < np.linalg.norm(plain.pose, axis=1))[fast].all()


def test_a_late_clock_reads_late_onsets() -> None:
    plain, late = onsets(slow(), Model(mu_s=MU)), onsets(slow(), model("clock_offset", delay_s=0.05))
    assert late - plain == pytest.approx(math.degrees(0.05 / 60.0), rel=1e-3)


def test_backlash_reads_steep_on_the_way_up() -> None:
    """The play is taken up within a third of a degree: the commands come as often as a recorded attitude."""
    half, often = 0.003, ramps(np.linspace(0.0, 30.0, 301), np.linspace(0.0, 0.5, 301))
    found = onsets(often, model("backlash", half_width_rad=half)) - onsets(often, Model(mu_s=MU))
    assert found == pytest.approx(math.degrees(half), rel=1e-6)


def test_a_pivot_above_the_block_or_below_it_slips_at_the_steps_early() -> None:
    plain, pushed = onsets(stepped(), Model(mu_s=MU)), onsets(stepped(), model("pivot_offset", z_m=0.1))
    assert pushed[0] < plain[0] - 0.1


def test_anisotropy_has_two_easy_directions() -> None:
    directions = np.radians([0.0, 90.0, 180.0, 270.0])
    found = onsets(slow(downhill_rad=directions), model("plate_anisotropy"))
    assert found[0] == pytest.approx(found[2], abs=1e-6)
    assert found[1] == pytest.approx(found[3], abs=1e-6)
    turned = onsets(slow(downhill_rad=directions, mount_rad=math.pi / 2), model("plate_anisotropy"))
    assert turned[0] == pytest.approx(found[1], abs=1e-6)


def test_one_way_friction_has_one_easy_direction() -> None:
    found = onsets(slow(downhill_rad=[0.0, math.pi]), model("one_way_friction", cos1=0.1))
    assert found[0] > math.degrees(math.atan(MU)) > found[1]


def test_an_uneven_contact_turns_the_block() -> None:
    turned = run(steep(), model("uneven_contact"))
    assert np.abs(turned.pose[:, 2]).max() > 0.05


def test_creep_moves_the_block_before_its_onset() -> None:
    commands = ramps((0.0, 2.0), (0.2, 0.2))
    motions = simulate(commands, model("solver_creep", time_s=1e-4), time_s=[0.0, 1.0, 2.0])
    way = 1e-4 * 9.81 * math.sin(0.2)
    assert motions.path[0, :, 0] == pytest.approx([0.0, way, 2.0 * way], rel=1e-6)
    assert np.isnan(motions.onset_s[0])


def test_shaking_moves_onsets_by_what_is_drawn() -> None:
    """A block slips early on average; what is drawn comes on top of that."""
    commands = slow(run=[0.0, 1.0, 2.0])
    chances = Chances(friction=np.ones(3), shake=np.array([-2.0, 0.0, 1.0]))
    found = simulate(commands, model("arm_vibration", sd_m_s2=0.1), chances=chances).onset_rad
    assert found[0] > math.atan(MU) > found[1] > found[2]
