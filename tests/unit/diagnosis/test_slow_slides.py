"""A block whose friction grows with the speed slides slowly above its limit, long before it is read to slip."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from station.diagnosis.observations.plate import PlateMotion
from station.diagnosis.observations.slow_slides import SlowSlides, before_slip
from station.diagnosis.observations.tracks import run_tracks
from station.physics.catalogue import catalogue
from station.physics.contact import GRAVITY_M_S2, Array
from station.physics.model import Model, Term
from tests.contracts.effect_states import contacts
from tests.unit.diagnosis.recorded import session

MU, PER_E_FOLD, CUT_OFF_M_S, LEAST_M_S = 0.36, 0.03, 7e-4, 1e-4
PLAIN = Model(mu_s=MU)


def law(name: str, **values: float) -> Model:
    effect = catalogue()[name]
    return Model(mu_s=MU, terms=(Term(effect, effect.neutral() | values),))


GROWING = law("rate_strengthening", per_e_fold=PER_E_FOLD, slower_decades=math.log10(0.1 / CUT_OFF_M_S), both_ways=1.0)

DRAG_PER_S = 12.0
"""The drag per mass, 1/s: as a film of oil has it that halves the acceleration of a slide at 0.1 m/s."""


def growth(speed_m_s: float) -> float:
    return 1.0 + PER_E_FOLD * math.asinh(0.5 * speed_m_s / CUT_OFF_M_S)


def slid(
    *, rate_rad_s: float, until_m_s: float, drag_per_s: float = 0.0, grown: Callable[[float], float] = growth
) -> tuple[Array, Array, Array]:
    """Times, s, tilts, rad, and ways, m, of a block on a plate that is tilted steadily, by plain steps of its law."""
    step_s, speed, way, time_s = 2e-5, 0.0, 0.0, 0.0
    rows = list[tuple[float, float, float]]()
    while speed < until_m_s:
        tilt = math.atan(MU) - 1e-3 + rate_rad_s * time_s
        excess = GRAVITY_M_S2 * (math.sin(tilt) - MU * grown(speed) * math.cos(tilt)) - drag_per_s * speed
        speed = max(speed + step_s * excess, 0.0)
        way, time_s = way + step_s * speed, time_s + step_s
        rows.append((time_s, tilt, way))
    return tuple(np.array(rows).T)  # type: ignore[return-value]


def slow(tilt_rad: float, speed_m_s: float, run: int = 3) -> SlowSlides:
    one = contacts(1, tilt_rad=tilt_rad, moving=False, slid_s=0.0)
    return SlowSlides(np.array([run]), one, np.array([speed_m_s]), np.array([LEAST_M_S]))


@pytest.mark.parametrize("rate_rad_s", [0.004, 0.02])
def test_its_way_follows_from_the_law(rate_rad_s: float) -> None:
    """Newton's law gives the same millimetres, from the load alone."""
    time_s, tilt_rad, way_m = slid(rate_rad_s=rate_rad_s, until_m_s=3e-3)
    before = slow(tilt_rad[-1], 3e-3).before(np.array([0, 3]), np.array([tilt_rad, tilt_rad]))
    (speed,) = before.speed_m_s(GROWING)
    assert before.rows.tolist() == [1]
    assert way_m[-1] > 4e-4
    assert np.trapezoid(speed, time_s) == pytest.approx(way_m[-1], rel=0.05)


def test_a_drag_holds_it_as_friction_does() -> None:
    """A film of oil lets no block get away at once; only the first tenth of a second is gone before it holds."""
    time_s, tilt_rad, way_m = slid(
        rate_rad_s=0.004, until_m_s=3e-3, drag_per_s=DRAG_PER_S, grown=lambda speed: float(speed >= 0.0)
    )
    seen = slow(tilt_rad[-1], 3e-3)
    oiled = law("viscous", drag_n_s_m=DRAG_PER_S * float(contacts(1).mass_kg[0]))
    (speed,) = seen.before(np.array([3]), tilt_rad[None]).speed_m_s(oiled)
    assert way_m[-1] > 1e-3
    assert np.trapezoid(speed, time_s) == pytest.approx(way_m[-1], rel=0.05)
    (grown,) = seen.log_grown_of(oiled, np.array([3]))
    held = DRAG_PER_S * np.array([LEAST_M_S, 3e-3]) / (GRAVITY_M_S2 * math.cos(tilt_rad[-1]))
    assert grown == pytest.approx(math.log((MU + held[1]) / (MU + held[0])), rel=1e-6)


def test_a_drag_is_shared_by_all_that_presses_the_block_on() -> None:
    mass_kg = float(contacts(1).mass_kg[0])
    oiled, sticky = law("viscous", drag_n_s_m=DRAG_PER_S * mass_kg), law("adhesion", force_n=0.5 * mass_kg)
    (grown,) = slow(0.36, 3e-3).log_grown_of(replace(oiled, terms=(*oiled.terms, *sticky.terms)), np.array([3]))
    held = DRAG_PER_S * np.array([LEAST_M_S, 3e-3]) / (GRAVITY_M_S2 * math.cos(0.36) + 0.5)
    assert grown == pytest.approx(math.log((MU + held[1]) / (MU + held[0])), rel=1e-6)


def test_a_push_that_knows_no_speed_is_part_of_the_load() -> None:
    shifted = law("pivot_offset", z_m=0.1)
    assert shifted.acting("push")
    assert np.all(slow(0.36, 3e-3).log_grown_of(shifted, np.array([3])) == 0.0)


NOTHING_LEFT = law("rate_strengthening", per_e_fold=-0.2, slower_decades=8.0)
"""Friction that has fallen to nothing at any speed that shows."""


@pytest.mark.parametrize(
    "model", [PLAIN, law("kinetic_drop", drop=0.1), law("stribeck", drop=0.1, speed_m_s=0.01), NOTHING_LEFT]
)
def test_a_block_stands_below_its_limit_if_friction_does_not_grow(model: Model) -> None:
    seen = slow(0.36, 3e-3)
    assert np.all(seen.before(np.array([3]), np.linspace(0.2, 0.359, 20)[None]).speed_m_s(model) == 0.0)
    assert np.all(seen.log_grown_of(model, np.array([3])) == 0.0)


def test_an_onset_that_was_read_late_has_the_friction_of_its_speed() -> None:
    """Runs that did not slide before have none of it."""
    growth = PER_E_FOLD * (math.asinh(0.5 * 3e-3 / CUT_OFF_M_S) - math.asinh(0.5 * LEAST_M_S / CUT_OFF_M_S))
    found = slow(0.36, 3e-3).log_grown_of(GROWING, np.array([0, 3, 7]))
    np.testing.assert_allclose(found, [0.0, growth, 0.0], rtol=0.04)


def test_the_speed_before_a_slip_is_read_from_the_path() -> None:
    """A block that stands until it slips has none."""
    signals = session()
    plate = PlateMotion(signals.attitude, signals.motions)
    track = next(track for track in run_tracks(signals) if track.slid)
    down = float(plate.at(np.array([track.slip_ns])).down_rad[0])
    since_s = np.minimum((track.time_ns - track.slip_ns) * 1e-9, 0.0)[:, None]
    moved = track.pose + since_s * np.array([2e-3 * math.cos(down), 2e-3 * math.sin(down), 0.0])
    assert before_slip(track, plate) is None
    seen = before_slip(replace(track, pose=moved), plate)
    assert seen is not None
    assert seen[1] == pytest.approx(2e-3, abs=3 * seen[2])
    assert 0 < track.slip_ns - seen[0] < 120_000_000
