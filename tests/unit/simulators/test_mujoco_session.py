"""Recorded sessions in MuJoCo: the same runs, seen by the same camera, and the ellipse that stands in for a curve."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import ArrayLike

from station.physics.catalogue import catalogue
from station.physics.contact import Array
from station.physics.model import Model, Term
from station.signals.session import Signals
from station.simulators.mujoco.batch import simulate
from station.simulators.mujoco.osculating import osculating
from station.simulators.planar.commands import ramps
from station.simulators.planar.friction import Support
from station.simulators.simulator import Simulator, names, simulator
from tests.unit.simulators.test_planar_session import MU, golden, tossed


@cache
def repeated() -> Signals:
    recorded, rig = golden()
    return simulator("mujoco").repeat(recorded, Model(mu_s=MU), rig=rig)


def test_it_is_found_by_its_name() -> None:
    assert "mujoco" in names()
    assert isinstance(simulator("mujoco"), Simulator)


def test_the_friction_that_was_measured_gives_the_onset_that_was_measured() -> None:
    recorded, rig = golden()
    was = recorded.samples[1]
    own = Model(mu_s=math.tan(was.onset_angle_rad))
    now = simulator("mujoco").repeat(recorded, own, rig=rig).samples[1]
    assert now.onset_angle_rad == pytest.approx(was.onset_angle_rad, abs=math.radians(0.05))
    assert now.slip_ns == pytest.approx(was.slip_ns, abs=10e6)
    assert now.detect_ns == pytest.approx(was.detect_ns, abs=100e6)


def test_the_camera_sees_what_it_saw_of_the_planar_simulator() -> None:
    recorded, rig = golden()
    planar = simulator("planar").repeat(recorded, Model(mu_s=MU), rig=rig)
    away = np.linalg.norm(planar.corners.corner_px - repeated().corners.corner_px, axis=2)
    assert np.nanmax(away) < 3.0  # half a millimetre
    assert np.nanmedian(away) < 0.5
    for first, second in zip(planar.samples, repeated().samples, strict=True):
        assert second.onset_angle_rad == pytest.approx(first.onset_angle_rad, abs=math.radians(0.05))


def test_each_run_has_its_own_friction_when_chance_is_let_in() -> None:
    recorded, rig = golden()
    scattered = Model(mu_s=MU, scatter=0.05)
    first, again, planar = (
        simulator(name).repeat(recorded, scattered, rig=rig, rng=np.random.default_rng(3))
        for name in ("mujoco", "mujoco", "planar")
    )
    onsets = [[sample.onset_angle_rad for sample in each.samples] for each in (first, again, planar)]
    assert onsets[0] == onsets[1]
    assert len(set(onsets[0])) == 3
    assert onsets[0] == pytest.approx(onsets[2], abs=math.radians(0.05))


def test_a_late_camera_and_a_play_in_the_arm_are_seen() -> None:
    recorded, rig = golden()
    effects = catalogue()
    late = Model(mu_s=MU, terms=(Term(effects["clock_offset"], {"delay_s": 0.03, "of_arm": 0.0}),))
    found = simulator("mujoco").repeat(recorded, late, rig=rig)
    for was, now in zip(repeated().samples, found.samples, strict=True):
        assert now.slip_ns - was.slip_ns == pytest.approx(30e6, abs=2)
    play = Model(mu_s=MU, terms=(Term(effects["backlash"], {"half_width_rad": 0.01}),))
    found = simulator("mujoco").repeat(recorded, play, rig=rig)
    for was, now in zip(repeated().samples, found.samples, strict=True):
        assert now.onset_angle_rad - was.onset_angle_rad == pytest.approx(0.01, abs=2e-3)


def test_a_toss_slides_on_from_where_it_lies_flat() -> None:
    recorded, rig = tossed(0.2), golden()[1]
    wide = replace(rig, plate=replace(rig.plate, opening_m=4.0, side_m=4.0))
    simulated = simulator("mujoco").repeat(recorded, Model(mu_s=0.2), rig=wide)
    assert simulated.block.position_m == pytest.approx(recorded.block.position_m, abs=1.5e-3)


def test_a_block_that_holds_stays_where_it_is() -> None:
    commands = ramps((0.0, 1.0, 4.0), [[0.2, 0.97 * math.atan(MU), 0.97 * math.atan(MU)]], downhill_rad=[0.3, 2.0])
    motions = simulate(commands, Model(mu_s=MU), time_s=[0.0, 4.0], share=0.5)
    assert np.isnan(motions.onset_rad).all()
    assert np.linalg.norm(motions.pose[:, :2], axis=1).max() < 5e-6


def test_light_blocks_and_heavy_ones_do_the_same() -> None:
    commands = ramps((0.0, 0.6, 0.7, 0.9), [[0.3, 0.37, 0.37, 0.1]], mass_kg=[0.0005, 0.008, 0.8], border_m=0.045)
    found = simulate(commands, Model(mu_s=MU))
    assert np.ptp(found.onset_rad) < math.radians(0.02)
    assert np.ptp(found.pose[:, 0]) < 2e-4


# --- the ellipse ----------------------------------------------------------------------------------------------------


def support_of(along: ArrayLike, across: ArrayLike, axis: ArrayLike, way: Array) -> Array:
    """h of an ellipse in the directions `way`."""
    turn = way - np.asarray(axis)
    return np.hypot(np.asarray(along) * np.cos(turn), np.asarray(across) * np.sin(turn))


def test_an_ellipse_is_its_own() -> None:
    way, step = np.linspace(-3.0, 3.0, 41), 1e-4
    low, here, high = (support_of(0.5, 0.3, 0.4, way + turn) for turn in (-step, 0.0, step))
    found = osculating(Support(here, (high - low) / (2 * step), (high - 2 * here + low) / step**2), way)
    assert found.along == pytest.approx(np.full(41, 0.5), rel=1e-5)
    assert found.across == pytest.approx(np.full(41, 0.3), rel=1e-5)
    assert np.sin(found.axis_rad - 0.4) == pytest.approx(np.zeros(41), abs=1e-5)


def test_any_convex_curve_is_touched() -> None:
    way, step = np.linspace(-3.0, 3.0, 41), 1e-3
    value = 0.4 * (1 + 0.2 * np.cos(way) + 0.05 * np.cos(2 * way))
    slope = -0.4 * (0.2 * np.sin(way) + 0.1 * np.sin(2 * way))
    bend = -0.4 * (0.2 * np.cos(way) + 0.2 * np.cos(2 * way))
    found = osculating(Support(value, slope, bend), way)
    low, here, high = (support_of(*found, way + turn) for turn in (-step, 0.0, step))
    assert here == pytest.approx(value)
    assert (high - low) / (2 * step) == pytest.approx(slope, abs=1e-5)
    assert (high - 2 * here + low) / step**2 == pytest.approx(bend, abs=1e-4)


def test_a_round_curve_needs_no_axis() -> None:
    found = osculating(Support(np.array([0.3, 0.4]), 0.0, 0.0), np.array([1.0, 2.0]))
    assert np.array_equal(found.along, found.across)


def test_a_curve_that_is_not_convex_gives_a_flat_ellipse_and_no_nonsense() -> None:
    found = osculating(Support(np.array([0.4]), np.array([0.1]), np.array([-0.6])), np.array([0.3]))
    assert np.isfinite(found.along).all()
    assert 0 < found.across[0] < found.along[0]
