"""Blocks near their limit creep for many reasons: how near they came, and how little that tells."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from station.diagnosis import thresholds
from station.diagnosis.likelihood.noise import Noise, estimate_noise
from station.diagnosis.likelihood.slopes import residuals
from station.diagnosis.likelihood.whitening import Whitening
from station.diagnosis.observations.build import Recorded, evidence_of
from station.diagnosis.observations.channel import REST, Channel
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.nearness import nearness
from station.diagnosis.observations.rig_offsets import UNKNOWN_OFFSETS, RigOffsets
from station.diagnosis.observations.setting import Setting
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, session

SETTING = Setting(opening_radius_m=OPENING_RADIUS_M)
PLAIN = Model(mu_s=0.35)
ARM_M = np.array([0.0, 0.0, 0.2])


@cache
def recorded() -> Recorded:
    return Recorded(session(), SETTING)


@cache
def seen() -> Evidence:
    return evidence_of(session(), SETTING)


def resting() -> Channel:
    channel = seen().channel(REST)
    assert channel is not None
    return channel


def test_the_load_of_a_slow_tilt_is_the_slope_over_that_of_the_slip() -> None:
    track, plate = recorded().tracks[0], recorded().slipping
    time_ns, share = nearness(track, plate, np.zeros(3))
    slope = np.tan(plate.at(time_ns).tilt_rad)
    assert share[-1] == 1.0
    assert np.all(np.diff(share) >= 0.0)
    assert share == pytest.approx(slope / slope[-1], abs=0.02)


def test_a_plate_that_turns_about_another_point_loads_its_block_by_jerks() -> None:
    track, plate = recorded().tracks[0], recorded().slipping
    (_, configured), (_, true) = nearness(track, plate, np.zeros(3)), nearness(track, plate, ARM_M)
    assert np.abs(true - configured).max() > 0.02


def test_what_may_have_crept_falls_by_e_folds_below_the_limit() -> None:
    astray = resting().rows.astray
    assert 0.0 < astray.min() < 1e-3 * thresholds.PLACE_TRUSTED_M
    assert thresholds.PLACE_TRUSTED_M < astray.max() < thresholds.SHORTEST_REACH_M


def test_no_other_channel_is_led_astray() -> None:
    assert not any(channel.rows.astray.any() for channel in seen().channels if channel is not resting())


def test_a_block_that_creeps_near_its_limit_changes_no_channel_s_noise() -> None:
    """It creeps by 0.1 mm in all stretches in which it may have: the others tell how good the camera is.

    How much of what may have crept did so is a number of its own.
    """
    still = residuals(seen(), PLAIN)
    near = resting().rows.astray > resting().rows.sigma
    assert near.sum() > 5
    crept = {**still, REST: still[REST] + 1e-4 * near}
    changed = estimate_noise(seen(), crept)
    assert changed.astray[REST] > estimate_noise(seen(), still).astray[REST]
    assert replace(changed, astray={}) == replace(estimate_noise(seen(), still), astray={})


@pytest.mark.parametrize("share", [0.1, 0.4])
def test_how_much_of_what_may_have_crept_did_so_is_estimated(share: float) -> None:
    """A single block that slid long before its slip does not count for more than the others."""
    still, astray = residuals(seen(), PLAIN), resting().rows.astray
    for outlier in (1.0, 100.0):
        crept = share * astray * np.where(np.arange(len(astray)) == np.argmax(astray), outlier, 1.0)
        found = estimate_noise(seen(), {**still, REST: crept}).astray[REST]
        assert share <= found < 2.0 * share


def test_all_of_it_may_have_crept_where_nothing_tells() -> None:
    """It is never more, and other channels have none."""
    still, astray = residuals(seen(), PLAIN), resting().rows.astray
    assert estimate_noise(seen(), {**still, REST: 5.0 * astray}).astray[REST] == 1.0
    noise = estimate_noise(seen(), still)
    assert all(noise.astray[channel.name] == 1.0 for channel in seen().channels if channel is not resting())


def test_its_creep_is_measured_by_what_may_have_crept_alone() -> None:
    """However exact the channel seems to be."""
    noise = estimate_noise(seen(), residuals(seen(), PLAIN))
    row = int(np.argmax(resting().rows.astray))
    for factor in (0.3, 3.0):
        exact = replace(noise, factor={**noise.factor, REST: factor}, own={**noise.own, REST: 1e-9}, astray={REST: 1.0})
        assert _sigmas(exact, row, 1e-3) == pytest.approx(1e-3 / resting().rows.astray[row], rel=0.1)


def _sigmas(noise: Noise, row: int, moved_m: float) -> float:
    """Returns by how many standard deviations a resting block has moved that alone in its run is off by `moved_m`."""
    first = sum(len(channel) for channel in seen().channels[: seen().channels.index(resting())])
    whitening = Whitening(seen(), noise)
    moved = np.zeros(len(whitening.run))
    moved[first + row] = moved_m
    return math.sqrt(float(np.square(whitening(moved)).sum()))


def test_a_model_has_the_offsets_of_its_clock_and_its_pivot() -> None:
    known = catalogue()
    late = Term(known["clock_offset"], {"delay_s": 0.05, "of_arm": 0.0})
    turned = Term(known["pivot_offset"], {"x_m": 0.0, "y_m": 0.0, "z_m": 0.2})
    assert RigOffsets.of(PLAIN).is_near(UNKNOWN_OFFSETS)
    rig_offsets = RigOffsets.of(Model(mu_s=0.35, terms=(late, turned)))
    assert rig_offsets.late_s == 0.05
    assert rig_offsets.arm_m == pytest.approx(ARM_M)


@pytest.mark.parametrize(("late_s", "arm_m", "near"), [(0.0, 0.205, True), (0.0, 0.0, False), (0.01, 0.2, False)])
def test_slips_are_read_again_where_clock_or_pivot_are_others(late_s: float, arm_m: float, near: bool) -> None:
    read = RigOffsets(late_s, np.array([0.0, 0.0, arm_m]))
    assert RigOffsets(0.0, ARM_M).is_near(read) is near


def test_slips_are_read_about_the_pivot_of_the_rig_offsets() -> None:
    assert seen().rig_offsets.is_near(RigOffsets(0.0, np.zeros(3)))
    assert evidence_of(session(), SETTING, RigOffsets(0.0, ARM_M)).rig_offsets.arm_m == pytest.approx(ARM_M)
