"""Blocks near the foam, and openings of any outline."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from shared.rig import PlateConfig
from station.diagnosis.observations.build import Recorded, evidence_of
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.starts import leans
from station.physics.model import Model
from station.rig.outline import inside_by_m
from station.simulators.simulator import simulator
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, golden, joined

SQUARE = np.array([[-0.04, -0.03], [0.04, -0.03], [0.04, 0.03], [-0.04, 0.03]])
CORNERED = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]])


def test_how_far_a_place_is_inside_an_outline() -> None:
    places = np.array([[0.0, 0.0], [0.035, 0.01], [0.05, 0.0], [0.043, 0.034]])
    expected = [0.03, 0.005, -0.01, -0.005]
    np.testing.assert_allclose(inside_by_m(SQUARE, places), expected, atol=1e-12)
    np.testing.assert_allclose(inside_by_m(SQUARE[::-1], places), expected, atol=1e-12)


def test_an_outline_may_have_a_corner_that_points_inwards() -> None:
    places = np.array([[0.5, 2.0], [2.0, 2.0], [0.8, 0.8], [1.5, 1.5]])
    expected = [0.5, -1.0, np.hypot(0.2, 0.2), -0.5]
    np.testing.assert_allclose(inside_by_m(CORNERED, places), expected, atol=1e-12)


def test_a_many_sided_outline_is_a_round_one() -> None:
    angles = np.linspace(0.0, 2 * np.pi, 720, endpoint=False)
    outline = tuple((0.045 * float(np.cos(a)), 0.045 * float(np.sin(a))) for a in angles)
    poses = np.random.default_rng(1).uniform(-0.04, 0.04, (50, 3))
    many, round_one = Setting(opening_outline_m=outline), Setting(opening_radius_m=0.045)
    np.testing.assert_allclose(many.free_m(poses), round_one.free_m(poses), atol=1e-6)


def test_two_corners_are_no_outline() -> None:
    with pytest.raises(ValueError, match="at least 3 corners"):
        PlateConfig(opening_outline_m=((0.0, 0.0), (0.1, 0.0)))


def test_the_slide_of_a_block_that_lay_at_the_foam_counts_where_it_is_free() -> None:
    """The onset does not count: the foam may have held or hastened it."""
    recorded, rig = golden()
    rig = replace(rig, plate=replace(rig.plate, opening_m=2 * OPENING_RADIUS_M))
    rng = np.random.default_rng(2)
    signals = joined([simulator("planar").repeat(recorded, Model(mu_s=0.35), rig=rig, rng=rng) for _ in range(2)])
    wide = Recorded(signals, Setting(opening_radius_m=OPENING_RADIUS_M))
    reach = np.array([np.hypot(*track.pose[0, :2]) for track in wide.tracks])
    ends = np.array([np.hypot(*track.pose[-1, :2]) for track in wide.tracks])
    inwards = int(np.argmax(reach - ends))
    narrow = Setting(opening_radius_m=float(reach[inwards]) + 0.01 / np.sqrt(2))
    assert leans(wide.tracks[inwards], narrow)
    evidence = evidence_of(signals, narrow)
    onset, along = evidence.channel("onset"), evidence.channel("along")
    assert onset is None or inwards not in onset.rows.run
    assert along is not None
    assert inwards in along.rows.run
