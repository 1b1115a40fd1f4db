"""A lens makes a block that goes away from its axis seem to be slowed otherwise than it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.setting import Setting
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term
from station.simulators.simulator import simulator
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, golden

MU = 0.35
LENS = Term(catalogue()["lens_distortion"], {"k1": 0.06})
ROWS = Term(catalogue()["rolling_shutter"], {"readout_s": 0.05, "axis_later": 0.0})


def left_with_and_without(term: Term, channel: str) -> list[float]:
    """The root mean squares that a model with the term, and the plain one, leave of slides that were seen with it."""
    recorded, rig = golden()
    rig = replace(rig, plate=replace(rig.plate, opening_m=2 * OPENING_RADIUS_M))
    models = Model(mu_s=MU, terms=(term,)), Model(mu_s=MU)
    made = simulator("planar").repeat(recorded, models[0], rig=rig, rng=np.random.default_rng(5))
    found = evidence_of(made, Setting(opening_radius_m=OPENING_RADIUS_M)).channel(channel)
    assert found is not None
    return [float(np.sqrt(np.mean(np.square(found.residual(model))))) for model in models]


def test_a_slide_through_a_lens_is_as_the_lens_says() -> None:
    """A slide's windows show too much or too little under the plain law: just what the lens does to them."""
    with_lens, without = left_with_and_without(LENS, "along")
    assert with_lens < 0.5 * without


def test_rows_that_are_read_one_after_another_turn_a_mark_that_gains_speed_unevenly() -> None:
    """The plate turns back under the slide, and the mark's shear, half of which is a turn, grows ever less."""
    with_rows, without = left_with_and_without(ROWS, "turn")
    assert with_rows < 0.5 * without
