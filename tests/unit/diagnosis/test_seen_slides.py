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


def test_a_slide_through_a_lens_is_as_the_lens_says() -> None:
    """A slide's windows show too much or too little under the plain law: just what the lens does to them."""
    recorded, rig = golden()
    rig = replace(rig, plate=replace(rig.plate, opening_m=2 * OPENING_RADIUS_M))
    plain, bent = Model(mu_s=MU), Model(mu_s=MU, terms=(LENS,))
    made = simulator("planar").repeat(recorded, bent, rig=rig, rng=np.random.default_rng(5))
    along = evidence_of(made, Setting(opening_radius_m=OPENING_RADIUS_M)).channel("along")
    assert along is not None
    with_lens, without = (float(np.sqrt(np.mean(np.square(along.residual(model))))) for model in (bent, plain))
    assert with_lens < 0.5 * without
