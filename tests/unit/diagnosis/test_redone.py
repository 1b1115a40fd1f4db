"""A session that is done again on paper: truths whose blocks go the same ways share it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from station.diagnosis.inference.columns import looked
from station.diagnosis.next_experiment.choice import Bench, protocol_of
from station.diagnosis.next_experiment.on_paper import on_paper, standard
from station.diagnosis.next_experiment.plan import dwells_of
from station.diagnosis.next_experiment.redone import SAME_RAD, Recorded, redone
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.onsets import Onsets
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.slides import Along
from station.physics.catalogue import catalogue
from station.physics.contact import Array
from station.physics.effect import Effect
from station.physics.model import Model, Term
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, joined, session

KNOWN = catalogue()
PLAIN = Model(mu_s=0.4)
SEEN = [effect for effect in KNOWN.values() if effect.layer != "numerics"]


def level(deg: float) -> Model:
    tilt = {"eps_x_rad": math.radians(deg)}
    return PLAIN.with_term(Term(KNOWN["platform_level"], {**KNOWN["platform_level"].neutral(), **tilt}))


def done_again(*truths: Model) -> list[Evidence]:
    recorded: Recorded = on_paper(standard(np.random.default_rng(0), 120), mu_s=PLAIN.mu_s)
    picked, draw = protocol_of(recorded, (), runs=60)
    return redone(recorded, picked, draw, truths=truths)


def test_blocks_that_go_the_same_ways_share_a_session() -> None:
    drop = PLAIN.with_term(Term(KNOWN["kinetic_drop"], {"drop": 0.3}))
    one, same, nearly, elsewhere = done_again(PLAIN, drop, level(0.1), level(3.0))
    assert same is one
    assert nearly is one
    assert elsewhere is not one


@pytest.fixture(scope="module")
def apart() -> tuple[Evidence, Evidence]:
    """Two sessions whose blocks' ways differ by up to a little more than SAME_RAD."""
    one, other = done_again(PLAIN, level(0.25))
    slides = [session.slides for session in (one, other)]
    ways = [slide.contact.way_rad for slide in slides if isinstance(slide, Along)]
    assert SAME_RAD < float(np.abs(np.sin(ways[0] - ways[1])).max()) < 1.5 * SAME_RAD
    return one, other


@pytest.mark.parametrize("effect", SEEN, ids=lambda effect: effect.id)
def test_such_ways_hardly_change_what_a_number_does(effect: Effect, apart: tuple[Evidence, Evidence]) -> None:
    one, other = (looked(session, PLAIN, [effect]).table.rows for session in apart)
    rows = np.arange(one.shape[0])
    size = np.linalg.norm(one.of(rows), axis=0)
    assert np.all(np.linalg.norm(other.of(rows) - one.of(rows), axis=0) <= 0.04 * size)


@pytest.fixture(scope="module")
def stepped() -> Recorded:
    """A session of one dwell whose plate waits in every step of its tilt."""
    known = Recorded.of(evidence_of(joined([session()]), Setting(opening_radius_m=OPENING_RADIUS_M)))
    assert known is not None
    return known


def test_waits_in_the_steps_of_a_tilt_are_no_dwell(stepped: Recorded) -> None:
    """A dwell ends where the tilt begins: the same again has one dwell, and no words that it is drawn anew."""
    dwell_s = np.array([sample.dwell_s for sample in session().samples])
    np.testing.assert_allclose(stepped.protocol()["dwell_s"], dwell_s[stepped.runs])
    assert not dwells_of(Bench(recorded=stepped))


def test_a_tilt_done_again_waits_in_its_steps_whatever_its_rate(stepped: Recorded) -> None:
    draw, picked = stepped.protocol(), np.arange(len(stepped.runs))
    rates = (draw["rate"], 2.0 * draw["rate"])
    same, faster = (redone(stepped, picked, draw | {"rate": rate}, truths=[PLAIN])[0] for rate in rates)
    at = stepped.onsets.contact.chosen(stepped.rows)
    np.testing.assert_allclose(rested_s(same), at.rest_s)
    tilt_rad = float(np.median(stepped.onsets.contact.tilt_rad))
    np.testing.assert_allclose(rested_s(same) - rested_s(faster), tilt_rad / draw["rate"] / 2.0)


def rested_s(evidence: Evidence) -> Array:
    onsets = evidence.channel("onset")
    assert isinstance(onsets, Onsets)
    return onsets.contact.rest_s


def test_blocks_gain_speed_in_the_picture_of_a_session_done_again() -> None:
    evidence = evidence_of(joined([session()]), Setting(opening_radius_m=OPENING_RADIUS_M))
    known = Recorded.of(evidence)
    assert known is not None
    (again,) = redone(known, *protocol_of(known, (), runs=2 * evidence.runs), truths=[PLAIN])
    shutter = KNOWN["rolling_shutter"]
    seen = looked(again, PLAIN, [shutter]).table.rows
    assert seen.shape[0] == sum(len(channel) for channel in again.channels)
    slides = [one for one in again.channels if isinstance(one, Along)]
    view = slides[0].motion.view
    assert view is not None
    assert np.shape(view.acceleration_m_s2) == view.velocity_m_s.shape
