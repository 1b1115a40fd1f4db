"""The friction that a model is written with is the recorded one, whatever a fit allowed for beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from station.diagnosis.inference.fit import as_simulated, fit, levelled
from station.diagnosis.likelihood.systematic import allowing_for
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.table import table_evidence
from station.physics.catalogue import catalogue
from station.physics.model import Model
from tests.unit.diagnosis.tables import samples


@pytest.mark.parametrize("exponent", [0.0, 0.2, 0.5])
def test_a_law_of_the_load_that_nobody_can_see_takes_no_part_of_the_level_with_it(exponent: float) -> None:
    """Of one mass, 0.2 with a law of the load was once written as 0.06 without it."""
    table = samples(runs=80)
    evidence = table_evidence(table, Setting())
    null = fit(evidence, levelled(evidence, Model(mu_s=0.4)), ())
    (allowed,) = allowing_for(null.model, [catalogue()["load_dependence"]]).terms[-1:]
    bent = replace(null.model, mu_s=0.06).with_term(allowed.with_values(exponent=exponent))
    recorded = float(np.median([np.tan(one.onset_angle_rad) for one in table]))
    assert as_simulated(evidence, replace(null, model=bent)).mu_s == pytest.approx(recorded, rel=0.03)
