"""A block that turns while it slides, against what can be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from station.physics.catalogue import catalogue
from station.physics.contact import Array
from station.physics.model import Model, Term
from station.physics.sole import TURNING_RADIUS
from station.simulators.planar.commands import ramps
from station.simulators.planar.simulate import simulate
from station.simulators.planar.turning import Turning, decays, rate_after, rate_at_full, rate_at_half

MU, SPEED_M_S, DECELERATION_M_S2 = 0.2, 0.5, 0.2 * 9.81
POWER = 6.0 * TURNING_RADIUS**2
"""ρ² / k² of a square."""


def test_a_slow_turn_fades_with_a_power_of_the_speed() -> None:
    """ω′ = −(ρ²/k²) mu g ω / v and v′ = −mu g give ω = ω₀ (v / v₀)^(ρ²/k²), while ρ ω is far below v."""
    rate = 0.05
    commands = ramps((0.0, 2.0), (0.0, 0.0), velocity=[[SPEED_M_S, 0.0, rate]])
    stop_s = SPEED_M_S / DECELERATION_M_S2
    times = np.linspace(0.0, stop_s, 9)
    path = simulate(commands, Model(mu_s=MU), time_s=times).path[0]
    left = 1.0 - times / stop_s
    expected = rate * stop_s / (POWER + 1.0) * (1.0 - left ** (POWER + 1.0))
    assert path[:, 2] == pytest.approx(expected, abs=2e-5)


def test_a_block_that_spins_fast_slides_farther() -> None:
    """Sliding and turning share one friction: with ρ ω = v, only 1/√2 of it is against the sliding."""
    fast = SPEED_M_S / (TURNING_RADIUS * 0.01)
    commands = ramps(np.tile([0.0, 2.0], (2, 1)), [[0.0, 0.0]], velocity=[[0.5, 0.0, 0.0], [0.5, 0.0, fast]])
    path = simulate(commands, Model(mu_s=MU), time_s=[0.0, 0.01, 0.02]).path[..., 0]
    lost = 0.5 * np.array([0.01, 0.02]) - path[:, 1:]
    assert lost[1] == pytest.approx(lost[0] / np.sqrt(2.0), rel=0.03)
    ends = simulate(commands, Model(mu_s=MU)).pose[:, 0]
    assert ends[1] > 1.2 * ends[0]


def test_a_block_whose_friction_acts_ahead_of_its_mass_swings_round() -> None:
    """Ahead of the mass and a little aside, it comes to act behind it, if the slide is long enough."""
    effect = catalogue()["uneven_contact"]
    model = Model(mu_s=0.3, terms=(Term(effect, {**effect.neutral(), "x_m": 2e-3, "y_m": -0.3e-3}),))
    motions = simulate(ramps((0.0, 0.5, 3.0), (0.25, 0.35, 0.6)), model, time_s=[3.0])
    ahead = motions.path[0, 0, 2] + np.arctan2(0.3e-3, -2e-3)
    assert np.cos(ahead) > 0.95


@pytest.mark.parametrize("decay", [1e-6, 0.3, 1.9, 2.1, 40.0, 4000.0])
def test_a_steady_drive_is_followed_exactly(decay: float) -> None:
    """With nothing else changing the rule is the exponential approach itself, however long the step."""
    step, drive, rate = np.array([0.01]), np.array([3.0]), np.array([0.7])

    def stage(now: Array) -> Turning:
        return Turning(np.ones(1), now, drive, np.array([decay]), np.array([False]))

    first = stage(rate)
    way = decays(first, step)
    second = stage(rate_at_half(first, way))
    third = stage(rate_at_full(first, second, way))
    after, off = rate_after(first, second, third, way)
    end = drive / decay
    assert after == pytest.approx(end + (rate - end) * np.exp(-decay * step), rel=1e-6)
    assert off == pytest.approx(0.0, abs=1e-6)
