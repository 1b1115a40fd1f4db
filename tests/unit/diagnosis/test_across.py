"""The sideways force of slides: a run's own friction aside makes no plate steeper, and a leaning plate still shows."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.diagnosis.likelihood.leading import PRESSURE_LEAD
from station.diagnosis.observations.channel import rows_of
from station.diagnosis.observations.moments import Moments, RunFacts
from station.diagnosis.observations.plate import Attitude
from station.diagnosis.observations.slides import LEAST_SLOPE_RAD, Across, Motion
from station.diagnosis.observations.windows import WEIGHTS
from station.physics.catalogue import catalogue
from station.physics.contact import GRAVITY_M_S2, Array
from station.physics.model import Model, Term
from station.physics.reversals import SWINGS

RUNS, WINDOWS, NODES = 40, 5, len(WEIGHTS)
MU, TILT_RAD = 0.36, 0.42
PLAIN = Model(mu_s=MU)
LEANING = Model(mu_s=MU, terms=(Term(catalogue()["platform_level"], {"eps_x_rad": 0.012, "eps_y_rad": -0.016}),))
STEEPER = Model(mu_s=MU, terms=(Term(catalogue()["angle_scale"], {"gain": 0.01, "offset_rad": 0.005}),))

RUN = np.repeat(np.arange(RUNS), WINDOWS)
NODE_RUN = np.repeat(RUN, NODES)
DOWN_RAD: Array = np.linspace(0.0, 2.0 * math.pi, RUNS, endpoint=False)[NODE_RUN]


def moments_of(way_rad: Array, tilt_rad: Array | float = TILT_RAD) -> Moments:
    """Slides at 0.1 m/s in directions (3 n,) on a plate of that tilt, in free directions."""
    count = len(NODE_RUN)
    tilt, zero = np.broadcast_to(tilt_rad, count), np.zeros((count, 3))
    level = np.sin(tilt)
    gravity = np.column_stack([level * np.cos(DOWN_RAD), level * np.sin(DOWN_RAD), -np.cos(tilt)])
    plate = Attitude(gravity, zero, zero, np.ones(count), np.ones(count), np.ones((count, SWINGS)), np.ones(count))
    known = dict.fromkeys(("dwell_s", "mount_rad", "temperature_c", "relative_humidity"), np.zeros(RUNS))
    facts = RunFacts(
        number=np.arange(RUNS, dtype=np.float64),
        rest_ns=np.zeros(RUNS, dtype=np.int64),
        mass_kg=np.full(RUNS, 0.01),
        area_m2=np.full(RUNS, 1e-4),
        **known,
    )
    return Moments(
        time_ns=np.tile(np.arange(WINDOWS * NODES) * 30_000_000, RUNS),
        run=NODE_RUN,
        facts=facts,
        attitude=lambda _: plate,
        velocity_m_s=0.1 * np.column_stack([np.cos(way_rad), np.sin(way_rad)]),
        moving=np.ones(count, dtype=np.bool_),
    )


def across_of(
    way_rad: Array,
    tilt_rad: Array | float = TILT_RAD,
    *,
    yaw_rate_rad_s: Array | float = 0.0,
    usual_way_rad: Array | None = None,
) -> Across:
    """Slides that go straight in directions (3 n,), each at a steady rate of speeding, and of turning (3 n,)."""
    moments = moments_of(way_rad, tilt_rad)
    toward = np.column_stack([np.cos(way_rad), np.sin(way_rad)])[NODES // 2 :: NODES]
    gained = 0.1 * GRAVITY_M_S2 * toward
    none = np.zeros(len(RUN), dtype=np.int64)
    rows = rows_of({"run": RUN, "from_ns": none, "to_ns": none, "sigma": np.full(len(RUN), 1e-3)}, {})
    motion = Motion(
        moments, gained, np.zeros(len(RUN)), yaw_rate_rad_s=yaw_rate_rad_s, usual_way_rad=usual_way_rad
    )  # fmt: skip
    return Across(rows, motion)


def test_uneven_soles_do_not_make_the_plate_steeper() -> None:
    """Each run's own sideways friction holds it on a way of its own; no steepness explains that."""
    off = np.random.default_rng(20261441).normal(0.0, 0.05, RUNS)
    across = across_of(DOWN_RAD + off[NODE_RUN])
    plain = across.residual(PLAIN)
    assert np.std(plain) > 0.03
    assert np.abs(across.residual(STEEPER) - plain).max() < 1e-12


def test_uneven_soles_are_no_grain() -> None:
    """The slope of a grain is that on the way of such slides, which no run's own sideways friction sets."""
    grain = PLAIN.with_term(Term(catalogue()["plate_anisotropy"], {"cos2": 0.1, "sin2": 0.0, "shape": 0.0}))
    own = np.random.default_rng(20261443).normal(0.0, 0.05, RUNS)[NODE_RUN]
    usual, aside = across_of(DOWN_RAD), across_of(DOWN_RAD + own, usual_way_rad=DOWN_RAD)
    expected = usual.residual(grain) - usual.residual(PLAIN)
    changed = aside.residual(grain) - aside.residual(PLAIN)
    assert np.std(expected) > 0.05
    assert changed == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize("own_rad", [0.0, 0.03], ids=["alike", "each its own way"])
def test_a_leaning_plate_shows_in_the_ways_of_slides(own_rad: float) -> None:
    """Along the true steepest line nothing is left; runs of their own ways leave what they would on a level plate."""
    pull = moments_of(DOWN_RAD).loads(LEANING).tangential
    true: Array = np.asarray(np.arctan2(pull[:, 1], pull[:, 0]), dtype=np.float64)
    own = np.random.default_rng(20261442).normal(0.0, own_rad, RUNS)[NODE_RUN]
    across = across_of(true + own)
    left = across_of(DOWN_RAD + own).residual(PLAIN)
    wrong = np.sqrt(np.mean(np.square(across.residual(PLAIN) - left)))
    assert wrong > 0.03
    assert np.sqrt(np.mean(np.square(across.residual(LEANING) - left))) < 0.03 * wrong


def test_a_block_on_a_level_plate_goes_where_it_was_sent() -> None:
    """Without a slope there is no steepest line: a push that leans aside acts across the block's own way."""
    way: Array = np.asarray(DOWN_RAD + 1.0, dtype=np.float64)
    across = across_of(way, 0.5 * LEAST_SLOPE_RAD)
    added = across.motion.moments.loads(LEANING).tangential - across.motion.moments.plain.tangential
    left = np.column_stack([-np.sin(way), np.cos(way)])
    expected = (added * left).sum(axis=1)[NODES // 2 :: NODES]
    changed = across.residual(LEANING) - across.residual(PLAIN)
    assert np.corrcoef(changed, expected)[0, 1] == pytest.approx(1.0, abs=1e-6)


def test_a_turning_block_is_carried_aside_where_its_pressure_leads() -> None:
    """Its friction carries it by lead L ω / v (1 cm, 0.1 m/s); a nap carries nothing aside, a grain does."""
    known = catalogue()
    rate = np.random.default_rng(20261483).normal(0.0, 1.0, RUNS)[NODE_RUN]
    across = across_of(DOWN_RAD, yaw_rate_rad_s=rate)
    tall = Term(PRESSURE_LEAD, {"lead": 0.15})
    carried = (across.residual(PLAIN) - across.residual(PLAIN.with_term(tall)))[:: len(WEIGHTS)]
    expected = (0.15 * 0.01 * rate / 0.1)[NODES // 2 :: NODES][:: len(WEIGHTS)]
    assert carried == pytest.approx(expected * MU * math.cos(TILT_RAD) / (math.sin(TILT_RAD) - 0.1), rel=0.04)
    nap = known["one_way_friction"]
    for sideways, moved in ((0.0, 0.0), (1.0, 0.1)):
        term = Term(nap, {**nap.neutral(), "cos1": 0.1, "sideways": sideways})
        changed = across.residual(PLAIN.with_term(term)) - across.residual(PLAIN)
        assert np.abs(changed).max() == pytest.approx(moved, rel=0.1, abs=1e-9)
