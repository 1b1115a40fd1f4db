"""The planar simulator against the exact slider, and what must hold for any model."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.physics.model import Model
from station.simulators import slider
from station.simulators.planar.commands import Commands, ramps, tracks
from station.simulators.planar.simulate import Chances, Motions, simulate
from station.simulators.slider import LimitCurve, Slide, Tilt
from tests.unit.simulators.ellipse import model_of

UP_AND_BACK = ((0.0, 2.0, 2.1, 3.0), (0.25, 0.52, 0.52, 0.0))
ROUND = LimitCurve(mu_along=0.45, mu_across=0.45)


def downhill(tilt: Tilt) -> float:
    return math.atan2(tilt.slope[1], tilt.slope[0])


def both(
    tilt: Tilt, curve: LimitCurve, *, start_m: tuple[float, float] = (0.0, 0.0), output_s: float = 0.01
) -> tuple[Motions, Slide]:
    exact = slider.simulate(tilt, curve, start_m=start_m, output_s=output_s)
    commands = ramps(tilt.time_s, tilt.angle_rad, downhill_rad=downhill(tilt), start=[[*start_m, 0.3]])
    return simulate(commands, model_of(curve), time_s=exact.time_s), exact


def apart(fast: Motions, exact: Slide) -> float:
    return float(np.linalg.norm(fast.path[0, :, :2] - exact.place_m, axis=1).max())


def resting(exact: Slide, tilt: Tilt, start_m: tuple[float, float]) -> float:
    """The tilt at which a plate at rest would have let go: a steady turning pulls a block away from its axis."""
    rate = float(np.diff(tilt.angle_rad)[0] / np.diff(tilt.time_s)[0])  # all let go on the first ramp
    pull = np.sin(exact.onset_rad) * tilt.slope + rate**2 / slider.GRAVITY * (tilt.slope @ start_m) * tilt.slope
    return math.atan2(float(np.linalg.norm(pull)), math.cos(exact.onset_rad))


@pytest.mark.parametrize(
    ("ratio", "axis", "azimuth"), [(1.0, 0.0, 0.0), (1.0, 0.0, 2.2), (0.7, 0.4, 0.0), (1.5, -1.0, 4.0), (2.0, 1.0, 0.3)]
)
def test_onset_and_path_are_those_of_the_exact_slider(ratio: float, axis: float, azimuth: float) -> None:
    curve = LimitCurve(mu_along=0.45 * math.sqrt(ratio), mu_across=0.45 / math.sqrt(ratio), axis_rad=axis)
    tilt = Tilt(time_s=UP_AND_BACK[0], angle_rad=UP_AND_BACK[1], azimuth_rad=azimuth)
    fast, exact = both(tilt, curve, start_m=(0.01, -0.02))
    way = float(np.linalg.norm(exact.place_m[-1] - exact.place_m[0]))
    assert len(exact.time_s) >= 299
    assert way > 1e-2
    assert fast.onset_s[0] == pytest.approx(exact.onset_s, abs=1e-8)
    assert fast.onset_rad[0] == pytest.approx(resting(exact, tilt, (0.01, -0.02)), abs=1e-8)
    assert apart(fast, exact) < 1e-6 + 1e-5 * way


def test_several_slips_in_one_tilt() -> None:
    """Down and back, twice: each slide begins at the friction angle and ends by itself."""
    tilt = Tilt(time_s=(0.0, 1.0, 1.2, 2.2, 2.4), angle_rad=(0.0, 0.45, 0.0, 0.45, 0.0))
    fast, exact = both(tilt, ROUND, output_s=0.001)
    assert apart(fast, exact) < 1e-6
    assert fast.pose[0, 1] == pytest.approx(exact.place_m[-1, 1], abs=1e-6)
    assert fast.slip_end_s[0] < 1.2


def test_a_block_that_holds_never_moves() -> None:
    motions = simulate(ramps((0.0, 3.0), (0.0, 0.3)), Model(mu_s=0.5), time_s=np.arange(0.0, 3.0, 0.1))
    assert np.isnan(motions.onset_s).all()
    assert np.isnan(motions.onset_rad).all()
    assert not motions.path.any()


def finely(tilt: Tilt, step_s: float = 0.01) -> Commands:
    times = step_s * np.arange(round(tilt.time_s[-1] / step_s) + 1, dtype=float)
    angles = np.interp(times, tilt.time_s, tilt.angle_rad)
    down = np.column_stack([*(np.sin(angles) * part for part in tilt.slope), -np.cos(angles)])
    return tracks([times], [down])


def test_a_recorded_track_is_the_ramp_that_it_samples() -> None:
    """Only the forces of its jerks differ, which ramps leave out: they are felt away from the pivot only."""
    tilt = Tilt(time_s=(0.0, 2.0, 2.1, 2.3, 3.0), angle_rad=(0.25, 0.45, 0.45, 0.42, 0.3), azimuth_rad=0.8)
    fine, exact = finely(tilt), slider.simulate(tilt, ROUND)
    motions = simulate(fine, Model(mu_s=0.45), time_s=exact.time_s)
    way = float(np.linalg.norm(exact.place_m[-1]))
    assert way > 5e-3
    assert motions.onset_s[0] == pytest.approx(exact.onset_s, abs=1e-6)
    assert apart(motions, exact) < 0.02 * way


def test_runs_side_by_side_are_the_runs_alone() -> None:
    angles = np.linspace(0.3, 0.5, 7)
    commands = ramps((0.0, 2.0, 3.0), np.column_stack([0.1 * angles, angles, 0.0 * angles]), downhill_rad=angles * 9)
    model, times = model_of(LimitCurve(mu_along=0.35, mu_across=0.3)), np.arange(0.0, 3.0, 0.05)
    together = simulate(commands, model, time_s=times)
    for k in range(len(commands)):
        alone = simulate(commands.rows(slice(k, k + 1)), model, time_s=times)
        assert alone.path[0] == pytest.approx(together.path[k], abs=1e-9)
        assert alone.onset_s[0] == pytest.approx(together.onset_s[k], abs=1e-9, nan_ok=True)


def test_runs_of_different_length_keep_their_own_end() -> None:
    short, long = np.arange(0.0, 1.005, 0.01), np.arange(0.0, 3.005, 0.01)
    down = [np.column_stack([np.sin(0.2 * t), 0 * t, -np.cos(0.2 * t)]) for t in (short, long)]
    motions = simulate(tracks([short, long], down), Model(mu_s=math.tan(0.3)), time_s=[0.5, 1.5, 2.9])
    assert np.isnan(motions.onset_s[0])
    assert motions.onset_rad[1] == pytest.approx(0.3, abs=1e-6)
    assert motions.path[1, 2, 0] > motions.path[1, 1, 0] == 0.0


def test_scatter_moves_each_onset_by_its_own_factor() -> None:
    factors = np.array([0.8, 1.0, 1.2])
    commands = ramps(np.tile([0.0, 5.0], (3, 1)), [[0.0, 0.6]])
    motions = simulate(commands, Model(mu_s=0.4), chances=Chances(friction=factors, shake=np.zeros(3)))
    assert np.tan(motions.onset_rad) == pytest.approx(0.4 * factors, abs=1e-7)


def test_the_foam_holds_the_block_back() -> None:
    commands = ramps((0.0, 2.0, 4.0), (0.3, 0.7, 0.7), downhill_rad=[0.0, 1.0], border_m=0.045)
    motions = simulate(commands, Model(mu_s=0.4), time_s=np.arange(0.0, 4.0, 0.02))
    reach = np.linalg.norm(motions.path[:, :, :2], axis=2)
    assert (reach.max(axis=1) > 0.03).all()
    assert (reach.max(axis=1) < 0.045).all()
    still = np.abs(np.diff(motions.path[:, -20:, :2], axis=1)).max()
    assert still < 1e-6


def test_friction_never_adds_energy() -> None:
    curve = LimitCurve(mu_along=0.3, mu_across=0.5, axis_rad=0.4)
    commands = ramps((0.0, 1.0), (0.7, 0.7), downhill_rad=0.3)
    times = np.linspace(0.0, 1.0, 2001)
    path = simulate(commands, model_of(curve), time_s=times).path[0, :, :2]
    speed = np.linalg.norm(np.diff(path, axis=0), axis=1) / np.diff(times)
    height = path @ np.array([math.cos(0.3), math.sin(0.3)]) * math.sin(0.7)
    energy = 0.5 * speed**2 - 9.81 * 0.5 * (height[1:] + height[:-1])
    assert speed.max() > 1.0
    assert np.all(np.diff(energy) <= 1e-8)


@pytest.mark.parametrize(("downhill_rad", "reach_m"), [(0.0, 0.03), (math.pi, 0.03), (-math.pi / 2, 0.02)])
def test_a_block_is_stopped_by_the_side_of_an_opening_with_corners(downhill_rad: float, reach_m: float) -> None:
    """It hardly bounces off, and rests against the side."""
    outline = ((-0.03, -0.02), (0.03, -0.02), (0.03, 0.02), (-0.03, 0.02))
    commands = ramps((0.0, 2.0, 5.0), (0.0, 0.6, 0.6), downhill_rad=downhill_rad, outline_m=outline)
    path = simulate(commands, Model(mu_s=0.4), time_s=np.linspace(0.0, 5.0, 101)).path[0]
    way = np.array([math.cos(downhill_rad), math.sin(downhill_rad)])
    reached = path[:, :2] @ way + 0.005
    assert reached[-1] == pytest.approx(reach_m, abs=1e-3)
    assert reached.max() < reach_m + 3e-3
    assert np.abs(path[:, :2] @ [-way[1], way[0]]).max() < 1e-9
