"""A block under three tones, by plain steps of Newton's and Coulomb's laws: when the slide that gets away begins.

Nothing of `arm_vibration` is used here: this is what its file derives, and how far its law is from it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

from shared.geometry import Array
from station.physics.catalogue import catalogue
from tests.contracts.effect_states import contacts

STEP_S, BLOCKS, MU, AWAY_M = 5e-4, 250, 0.36, 2e-3
SHARES, PACES, PHASES = (1.0, 0.7, 0.5), (1.0, 1.37, 0.61), (1.0, 2.3, 5.1)


@dataclass(frozen=True)
class Away:
    """The slides that get away: the push by which they are early, mean and scatter in the shaking's deviations.

    `crept_m` is the median way that blocks have come before.
    """

    mean: float
    scatter: float
    crept_m: float


def away(*, tone_m_s2: float, hz: float, rate_deg_s: float) -> Away:
    """Blocks whose load grows evenly past their friction while three tones with chance phases shake them."""
    rng = np.random.default_rng(20261340)
    growth = 9.81 * math.radians(rate_deg_s) / math.cos(math.atan(MU))
    first, phase = rng.uniform(0.0, 20.0, BLOCKS), rng.uniform(0.0, 2 * math.pi, BLOCKS)
    speed, place, began = np.zeros(BLOCKS), np.zeros(BLOCKS), np.full(BLOCKS, np.nan)
    begin, crept, gone = began.copy(), np.zeros(BLOCKS), np.zeros(BLOCKS, dtype=np.bool_)
    for now in np.arange(-2.0 * sum(SHARES) * tone_m_s2 / growth, 3.0, STEP_S):
        push = _tones(now + first, tone_m_s2, hz, phase)
        excess = growth * now + push
        goes = (speed <= 0.0) & (excess > 0.0)
        begin[goes], crept[goes & ~gone] = now, place[goes & ~gone]
        speed = np.where((speed > 0.0) | goes, np.maximum(speed + STEP_S * excess, 0.0), 0.0)
        place += STEP_S * speed
        new = ~gone & (place - crept > AWAY_M)
        began[new], gone = begin[new], gone | new
        if gone.all():
            break
    early = -growth * began / (tone_m_s2 * math.sqrt(0.5 * sum(share * share for share in SHARES)))
    return Away(float(early.mean()), float(early.std()), float(np.median(crept)))


def _tones(time_s: Array, tone_m_s2: float, hz: float, phase: Array) -> Array:
    parts = zip(SHARES, PACES, PHASES, strict=True)
    return sum((tone_m_s2 * a * np.sin(2 * math.pi * hz * f * time_s + p * phase) for a, f, p in parts), np.zeros(1))


def _shaken(sd_m_s2: float, rate_deg_s: float, *, seed: int) -> tuple[float, float, Array, Array]:
    """The growth of the load, m/s³, the first tone's size, m/s², and the blocks' first times, s, and phases, rad."""
    rng = np.random.default_rng(seed)
    growth = 9.81 * math.radians(rate_deg_s) / math.cos(math.atan(MU))
    tone = sd_m_s2 / math.sqrt(0.5 * sum(share * share for share in SHARES))
    return growth, tone, rng.uniform(0.0, 20.0, BLOCKS), rng.uniform(0.0, 2 * math.pi, BLOCKS)


def test_weak_shaking_scatters_and_does_not_hasten() -> None:
    """The load passes the limit within a part of a cycle: each moment of it is as likely, and the mean push is none."""
    found = away(tone_m_s2=0.05, hz=3.0, rate_deg_s=14.0)
    assert found.mean == pytest.approx(0.0, abs=0.15)
    assert found.scatter == pytest.approx(1.0, abs=0.2)
    assert found.crept_m < 1e-5


def test_what_slips_at_a_crest_stops_in_the_trough() -> None:
    """It creeps, and goes when the mean load has caught up: not early, and with less scatter than the shaking has."""
    found = away(tone_m_s2=0.25, hz=8.0, rate_deg_s=3.0)
    assert found.mean == pytest.approx(0.0, abs=0.15)
    assert found.scatter < 0.4
    assert found.crept_m > 1e-4


def test_strong_shaking_throws_blocks_off_early() -> None:
    """A single slip of a slow, strong shake is a slide."""
    found = away(tone_m_s2=0.8, hz=3.0, rate_deg_s=3.0)
    assert found.mean > 0.6
    assert found.mean / found.scatter > 2.0


@pytest.mark.parametrize(("sd_m_s2", "hz"), [(0.19, 3.0), (0.06, 6.0), (0.4, 6.0), (0.19, 12.0), (0.4, 12.0)])
def test_a_traced_onset_scatters_as_the_law_says(sd_m_s2: float, hz: float) -> None:
    """Whatever the moment of the slip: the slide is pushed to and fro, and what is traced back is its mean course."""
    vibration = catalogue()["arm_vibration"]
    values = {**vibration.neutral(), "sd_m_s2": sd_m_s2, "cos1": 0.0, "sin1": 0.0, "tone_hz": hz}
    tilted = contacts(1, moving=False, down_rad=0.0)
    scatter, push = vibration.shaking(tilted, values), vibration.push(tilted, values)
    assert push is not None
    loads = traced_m_s2(sd_m_s2, hz, rate_deg_s=10.0)
    assert float(np.ravel(scatter)[0]) == pytest.approx(float(loads.std()), rel=0.4)
    assert push[0, 0] == pytest.approx(-float(loads.mean()), rel=0.5)


def traced_m_s2(sd_m_s2: float, hz: float, *, rate_deg_s: float, read_s: float = 0.15) -> Array:
    """The load beyond friction (blocks,), m/s², at which slides that were shaken seem to begin.

    A slide from rest on an even ramp has the way growth (t - t0)³ / 6, whose cube root is a line that begins at t0.
    """
    growth, tone, first, phase = _shaken(sd_m_s2, rate_deg_s, seed=20261125)
    times = np.arange(-2.0 * sum(SHARES) * tone / growth, 1.5, STEP_S)
    speed, place, rested = np.zeros(BLOCKS), np.zeros((len(times), BLOCKS)), np.zeros(BLOCKS)
    for k, now in enumerate(times):
        speed = np.maximum(speed + STEP_S * (growth * now + _tones(now + first, tone, hz, phase)), 0.0)
        place[k] = place[k - 1] + STEP_S * speed
        rested = np.where(speed > 0.0, rested, place[k])
    roots = np.cbrt(6.0 / growth * np.maximum(place - rested, 0.0))
    begins = (place - rested > 2e-4).argmax(axis=0) + np.arange(round(read_s / STEP_S))[:, None]
    read = np.take_along_axis(roots, begins, axis=0)
    return growth * (times[begins] - read).mean(axis=0)


@pytest.mark.parametrize("apart", [0.5, 1.0, 1.5])
def test_blocks_below_their_limit_creep_as_the_law_says(apart: float) -> None:
    """Plain Coulomb steps under 25 tones, at a constant distance to the limit in the push's deviations."""
    vibration, sd_m_s2, hz = catalogue()["arm_vibration"], 0.2, 8.0
    resting = contacts(1, moving=False, spare_m_s2=apart * sd_m_s2, down_rad=0.0)
    values = {**vibration.neutral(), "sd_m_s2": sd_m_s2, "cos1": 0.0, "sin1": 0.0, "tone_hz": hz}
    said = vibration.creep(resting, values)
    assert said is not None
    assert crept_m_s(sd_m_s2, hz, apart * sd_m_s2) == pytest.approx(said[0, 0], rel=0.2)


def crept_m_s(sd_m_s2: float, hz: float, spare_m_s2: float, *, cycles: int = 60, steps: int = 150) -> float:
    """The mean speed of blocks that a narrow band of tones shakes, by steps of Newton's and Coulomb's laws."""
    rng = np.random.default_rng(20261123)
    pace, phase = rng.uniform(0.8, 1.2, (25, 1)), rng.uniform(0.0, 2 * math.pi, (25, 150))
    step_s, speed, place = 1.0 / hz / steps, np.zeros(150), 0.0
    tone = sd_m_s2 * math.sqrt(2.0 / 25.0)
    for now in step_s * np.arange(cycles * steps):
        push = tone * np.sin(2.0 * math.pi * hz * pace * now + phase).sum(axis=0)
        speed = np.maximum(speed + step_s * (push - spare_m_s2), 0.0)
        place += step_s * float(speed.mean())
    return place / (cycles / hz)


def test_a_block_whose_limit_is_far_does_not_creep() -> None:
    """Ten deviations away, and while the block slides, there is nothing."""
    vibration = catalogue()["arm_vibration"]
    values = {**vibration.neutral(), "sd_m_s2": 0.1, "tone_hz": 1.0}
    far, moving = contacts(5, moving=False, spare_m_s2=1.5), contacts(5, moving=True, spare_m_s2=0.0)
    for state in (far, moving):
        said = vibration.creep(state, values)
        assert said is not None
        assert np.abs(said).max() < 1e-12


@pytest.mark.parametrize("hz", [3.0, 6.0, 12.0])
def test_slides_begin_on_a_rising_push(hz: float) -> None:
    """The mean push of the first half cycle, which gives a slide its velocity, is that of the steps."""
    vibration, sd_m_s2 = catalogue()["arm_vibration"], 0.19
    since_s = np.arange(STEP_S, 0.5 / hz, STEP_S)
    values = {**vibration.neutral(), "sd_m_s2": sd_m_s2, "cos1": 0.0, "sin1": 0.0, "tone_hz": hz}
    said = vibration.push(contacts(len(since_s), moving=True, slid_s=since_s, down_rad=0.0), values)
    assert said is not None
    stepped = pushed_m_s2(sd_m_s2, hz, rate_deg_s=4.0, since_s=since_s)
    assert said[:, 0].mean() == pytest.approx(stepped.mean(), rel=0.3)


def pushed_m_s2(sd_m_s2: float, hz: float, *, rate_deg_s: float, since_s: Array) -> Array:
    """The mean push (n,), m/s², of three tones on blocks `since_s` (n,) after they have slipped to get away."""
    growth, tone, first, phase = _shaken(sd_m_s2, rate_deg_s, seed=20261126)
    speed, way, released = np.zeros(BLOCKS), np.zeros(BLOCKS), np.zeros(BLOCKS)
    for now in np.arange(-2.0 * sum(SHARES) * tone / growth, 1.5, STEP_S):
        speed = np.maximum(speed + STEP_S * (growth * now + _tones(now + first, tone, hz, phase)), 0.0)
        way = np.where(speed > 0.0, way + STEP_S * speed, np.where(way > AWAY_M, way, 0.0))
        released = np.where((speed > 0.0) | (way > AWAY_M), released, now)
    return np.array([float(_tones(released + since + first, tone, hz, phase).mean()) for since in since_s])
