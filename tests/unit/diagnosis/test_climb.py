"""The climb to the maximum where little noise makes the likelihood a narrow valley that bends."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from station.diagnosis.inference.climb import CONVERGED, WORTH_RENEWING, Climb
from station.diagnosis.inference.fit import Fit, fit
from station.diagnosis.inference.level import levelled
from station.diagnosis.likelihood.systematic import allowing_for
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.setting import Setting
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term
from station.simulators.simulator import simulator
from tests.unit.diagnosis.recorded import OPENING_RADIUS_M, golden, joined

ABSORBED = ("adhesion", "angle_scale", "load_dependence")
"""The effects that mu absorbs with one mass and one angle sensor: nuisances, almost along one line."""
DROP = 0.3


@cache
def _simulated() -> tuple[Evidence, Fit]:
    """A simulation whose friction drops, without scatter, with the corners' noise; and its fit without the drop."""
    recorded, rig = golden()
    rig = replace(rig, plate=replace(rig.plate, opening_m=2 * OPENING_RADIUS_M))
    truth = Model(mu_s=0.35).with_term(Term(catalogue()["kinetic_drop"], {"drop": DROP}))
    rng = np.random.default_rng(6)
    session = joined([simulator("planar").repeat(recorded, truth, rig=rig, rng=rng) for _ in range(12)])
    evidence = evidence_of(session, Setting(opening_radius_m=OPENING_RADIUS_M))
    allowing = allowing_for(levelled(evidence, Model(mu_s=0.35)), [catalogue()[name] for name in ABSORBED])
    return evidence, fit(evidence, allowing, ())


def _from(drop: float) -> Fit:
    evidence, null = _simulated()
    begun = null.model.with_term(Term(catalogue()["kinetic_drop"], {"drop": drop}))
    return fit(evidence, begun, [catalogue()["kinetic_drop"]], noise=null.noise)


def test_the_maximum_is_the_same_wherever_the_climb_begins() -> None:
    """A fit that stops halfway leaves a gain that another effect is credited with."""
    near = _from(DROP)
    assert near.converged
    for drop in (0.05, 0.15, 0.45):
        assert _from(drop).converged
        assert _from(drop).log_likelihood == pytest.approx(near.log_likelihood, abs=2 * WORTH_RENEWING)


def test_a_climb_that_leads_nowhere_ends() -> None:
    """A climb at the top asks for slopes at most twice, and says that it has converged."""
    evidence, _ = _simulated()
    top = _from(DROP)
    climb = Climb(evidence, top.model, top.free, noise=top.noise)
    assert climb.climb(2, 10 * CONVERGED)
