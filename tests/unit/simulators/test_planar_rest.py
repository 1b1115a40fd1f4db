"""Onsets in the planar simulator: where they are looked for, and what they wait for."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.physics.catalogue import catalogue
from station.physics.model import Model, Term
from station.simulators.planar.commands import Commands, ramps, tracks
from station.simulators.planar.friction import LimitCurve, asks_for_direction
from station.simulators.planar.simulate import simulate
from tests.contracts.effect_states import contacts
from tests.unit.simulators.ellipse import Ellipse

ELLIPSE = Term(Ellipse(), {"ratio": 1.5, "axis_rad": 0.3})


def term(name: str, **values: float) -> Term:
    effect = catalogue()[name]
    return Term(effect, {**effect.neutral(), **values})


def bumpy(times: np.ndarray) -> Commands:
    """Slowly rising, with a bump of 40 ms that comes and goes between the windows' steepest moments elsewhere."""
    angles = 0.1 + 0.02 * times + 0.15 * np.exp(-(((times - 4.013) / 0.02) ** 2))
    return tracks([times], [np.column_stack([np.sin(angles), 0.0 * angles, -np.cos(angles)])])


def test_a_short_bump_of_a_recording_is_not_overlooked() -> None:
    times = np.arange(0.0, 8.0, 0.01)
    mu = math.tan(0.3)
    onset = simulate(bumpy(times), Model(mu_s=mu)).onset_s[0]
    assert 3.9 < onset < 4.02


def test_the_first_of_two_bumps_counts() -> None:
    times = np.arange(0.0, 6.0, 0.01)
    angles = 0.2 + sum(0.2 * np.exp(-(((times - at) / 0.03) ** 2)) for at in (2.0, 2.08, 4.0))
    commands = tracks([times], [np.column_stack([np.sin(angles), 0.0 * angles, -np.cos(angles)])])
    assert simulate(commands, Model(mu_s=math.tan(0.35))).onset_s[0] < 2.0


def strays(times: np.ndarray, pivot: np.ndarray, *, rate: float = 0.02) -> Commands:
    """A slow tilt down to x whose pivot has the acceleration `pivot` (k − 1, 3) in P."""
    angles = 0.1 + rate * times
    gravity = np.column_stack([np.sin(angles), 0.0 * angles, -np.cos(angles)])
    return tracks([times], [gravity], pivot_m_s2=[pivot])


def test_a_pivot_that_is_accelerated_uphill_lets_the_block_slip_earlier() -> None:
    """The onset is where g sin θ − A_x = mu (g cos θ + A_z)."""
    times = np.arange(0.0, 12.0, 0.01)
    pivot = np.tile([-0.5, 0.0, 0.3], (len(times) - 1, 1))
    onset = simulate(strays(times, pivot), Model(mu_s=0.3)).onset_rad[0]
    assert 9.81 * math.sin(onset) + 0.5 == pytest.approx(0.3 * (9.81 * math.cos(onset) + 0.3), abs=1e-6)


def test_a_short_push_of_the_pivot_is_not_overlooked() -> None:
    times = np.arange(0.0, 8.0, 0.01)
    pivot = np.zeros((len(times) - 1, 3))
    pivot[403:405, 0] = -2.0
    motions = simulate(strays(times, pivot), Model(mu_s=math.tan(0.3)), time_s=[4.025, 4.04])
    assert motions.onset_s[0] == pytest.approx(4.03, abs=1e-6)


def test_a_level_plate_that_is_pulled_away_leaves_its_block_behind() -> None:
    """The block's acceleration on the plate is A − mu g."""
    times = np.arange(0.0, 0.3, 0.01)
    pivot = np.tile([0.0, -5.0, 0.0], (len(times) - 1, 1))
    level = np.tile([0.0, 0.0, -1.0], (len(times), 1))
    path = simulate(tracks([times], [level], pivot_m_s2=[pivot]), Model(mu_s=0.3), time_s=[0.1, 0.2]).path[0]
    assert path[:, 1] == pytest.approx(0.5 * (5.0 - 0.3 * 9.81) * np.array([0.1, 0.2]) ** 2, rel=1e-4)


def test_only_effects_that_ask_for_the_direction_make_the_curve_oblong() -> None:
    assert asks_for_direction(ELLIPSE)
    assert not asks_for_direction(term("wear"))
    assert LimitCurve(Model(mu_s=0.3, terms=(term("contact_aging", per_decade=0.1),))).is_round
    assert not LimitCurve(Model(mu_s=0.3, terms=(ELLIPSE,))).is_round


def test_onsets_on_an_ellipse_are_those_of_its_limit_curve() -> None:
    """(g_along / mu_along)² + (g_across / mu_across)² = (g cos θ)², as for the exact slider."""
    directions = np.linspace(0.0, 6.2, 40)
    motions = simulate(ramps((0.0, 10.0), (0.0, 0.8), downhill_rad=directions), Model(mu_s=0.4, terms=(ELLIPSE,)))
    local = directions - 0.3
    along, across = 0.4 * math.sqrt(1.5), 0.4 / math.sqrt(1.5)
    expected = np.arctan(1.0 / np.hypot(np.cos(local) / along, np.sin(local) / across))
    assert motions.onset_rad == pytest.approx(expected, abs=1e-6)


def test_kinetic_friction_above_static_friction_lets_no_slip_get_away() -> None:
    """A contact holds less than a slowly sliding one: the block waits until it can slide, and does not stutter."""
    fresh = Model(mu_s=0.36, terms=(term("contact_aging", per_decade=0.1, sliding_age_log10_s=0.3),))
    motions = simulate(ramps((0.0, 0.4, 1.0), (0.25, 0.45, 0.1), rest_s=0.0), fresh)
    held = 0.36 * (1.0 - 0.1 * (0.3 - math.log10(0.1 + motions.onset_s[0])))  # the friction of a contact so young
    assert held < 0.34
    assert math.tan(motions.onset_rad[0]) == pytest.approx(0.36, abs=1e-3)
    assert motions.pose[0, 0] > 1e-3


def test_a_block_that_comes_sliding_stops_where_friction_says() -> None:
    """v² / (2 mu g) on a level plate, a little farther if it turns; the turning ends with the slide."""
    commands = ramps(np.tile([0.0, 2.0], (2, 1)), [[0.0, 0.0]], velocity=[[0.3, 0.4, 0.0], [0.3, 0.4, 1.0]])
    motions = simulate(commands, Model(mu_s=0.2), time_s=[1.0, 2.0])
    way = 0.5**2 / (2.0 * 0.2 * 9.81)
    straight, turning = np.linalg.norm(motions.pose[:, :2], axis=1)
    assert straight == pytest.approx(way, rel=1e-6)
    assert way < turning < way * (1.0 + 1e-4)
    assert motions.pose[0, 2] == 0.0
    assert 0.0 < motions.pose[1, 2] < 0.2
    assert np.isnan(motions.onset_s).all()
    assert np.array_equal(motions.path[:, 0], motions.path[:, 1])


def test_what_creeps_in_steps_is_what_creeps_in_one() -> None:
    creeping = Model(mu_s=0.6, terms=(term("solver_creep", time_s=2e-4),))
    times = np.arange(0.0, 4.005, 0.01)
    fine = tracks([times], [np.column_stack([np.sin(0.1 * times), 0 * times, -np.cos(0.1 * times)])])
    coarse = ramps((0.0, 4.0), (0.0, 0.4))
    ends = [simulate(commands, creeping).pose[0, 0] for commands in (fine, coarse)]
    assert ends[0] == pytest.approx(2e-4 * 9.81 * (1.0 - math.cos(0.4)) / 0.1, rel=1e-3)
    assert ends[1] == pytest.approx(ends[0], rel=1e-3)


def test_foam_carries_a_block_that_would_creep_on() -> None:
    """A block that lies in the foam neither creeps deeper nor stutters."""
    creeping = Model(mu_s=0.3, terms=(term("solver_creep", time_s=2e-4),))
    commands = ramps((0.0, 3.0, 20.0), (0.1, 0.4, 0.4), downhill_rad=[0.2, 1.0], border_m=0.045)
    path = simulate(commands, creeping, time_s=[1.0, 10.0, 20.0]).path
    assert (np.linalg.norm(path[:, 0, :2], axis=1) > 1e-5).all()
    assert path[:, 1] == pytest.approx(path[:, 2], abs=1e-6)
    assert (np.linalg.norm(path[:, 2, :2], axis=1) > 0.03).all()


def test_runs_begun_in_the_foam_rest_there() -> None:
    commands = ramps((0.0, 3.0), (0.0, 0.2), start=[[0.041, 0.0, 0.0]], border_m=0.045)
    motions = simulate(commands, Model(mu_s=0.3), time_s=[3.0])
    assert np.isnan(motions.onset_s[0])
    assert motions.path[0, 0, 0] == 0.041


@pytest.mark.parametrize("share", [0.3, 0.9])
def test_onsets_near_the_corners_of_a_pyramid_are_those_of_its_limit_curve(share: float) -> None:
    """tan θ is the least of h(φ) / cos(φ − descent) over all φ, also where Newton's method alone overshoots."""
    pyramid, directions = term("cone_artifact", share=share), np.linspace(0.0, 2.0 * np.pi, 72, endpoint=False)
    motions = simulate(ramps((0.0, 10.0), (0.0, 0.8), downhill_rad=directions), Model(mu_s=0.4, terms=(pyramid,)))
    off = np.linspace(-1.5, 1.5, 30_001)
    at = contacts(len(off))
    held = [0.4 * pyramid.effect.friction(at.facing(off + way), pyramid.values) / np.cos(off) for way in directions]
    expected = np.arctan(np.min(held, axis=1))
    assert np.degrees(np.abs(motions.onset_rad - expected).max()) < 0.002
