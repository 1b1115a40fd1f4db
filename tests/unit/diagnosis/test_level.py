"""The friction that a model is written with is the recorded one, whatever a fit allowed for beside it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from shared.messages import Sample
from station.diagnosis.inference.fit import fit
from station.diagnosis.inference.level import as_simulated, level_of, levelled
from station.diagnosis.likelihood.systematic import allowing_for
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.table import table_evidence
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term
from station.signals.measured import Measured
from tests.unit.diagnosis.tables import MU, samples


@pytest.mark.parametrize("exponent", [0.0, 0.2, 0.5])
def test_a_law_of_the_load_that_nobody_can_see_takes_no_part_of_the_level_with_it(exponent: float) -> None:
    """A level of 0.2 with a law of the load, at one mass, was once written as 0.06 without it."""
    table = samples(runs=80)
    evidence = table_evidence(table, Setting())
    null = fit(evidence, levelled(evidence, Model(mu_s=0.4)), ())
    (allowed,) = allowing_for(null.model, [catalogue()["load_dependence"]]).terms[-1:]
    bent = replace(null.model, mu_s=0.06).with_term(allowed.with_values(exponent=exponent))
    recorded = float(np.median([np.tan(one.onset_angle_rad) for one in table]))
    assert as_simulated(evidence, replace(null, model=bent)).mu_s == pytest.approx(recorded, rel=0.03)


def _held_beyond(seed: int) -> Evidence:
    """Runs with 3 % scatter, of which those that hold on beyond 0.404 end without a slide."""
    most = math.atan(1.01 * MU)
    made = [
        replace(one, onset_angle_rad=min(one.onset_angle_rad, most), censored=one.onset_angle_rad > most)
        for one in samples(runs=40, seed=seed)
    ]
    return table_evidence(made, Setting())


def test_runs_that_never_slid_do_not_lower_the_level_and_it_is_known_as_well_as_it_says() -> None:
    """With 40 % of the runs cut off, the median of the others would be off by two thirds of the scatter."""
    deviations = list[float]()
    for seed in range(30):
        evidence = _held_beyond(seed)
        assert evidence.onsets is not None
        assert evidence.onsets.rows.limit.any()
        level = level_of(evidence, fit(evidence, levelled(evidence, Model(mu_s=0.3)), ()))
        deviations.append((level.value - MU) / level.sd)
    assert abs(float(np.mean(deviations))) < 0.5
    assert 0.6 < float(np.sqrt(np.mean(np.square(deviations)))) < 1.5


def test_where_nobody_saw_a_block_let_go_the_level_is_that_of_the_slides() -> None:
    """A tribometer's 0.4 at a millimetre a second was once told as 0.24: that of a speed which nobody drove at."""
    speed = np.tile([1e-4, 3e-3, 3e-4, 1e-3], 20)
    friction = 0.4 * (1.0 + 0.03 * np.log(speed / 1e-3))
    columns = {"friction_coefficient": friction, "sliding_speed_m_s": speed, "time_s": np.arange(80.0)}
    samples_of_none = (Sample(),) * 80
    evidence = table_evidence(Measured(samples=samples_of_none, more=columns, group=()), Setting())
    effect = catalogue()["rate_strengthening"]
    plain = fit(evidence, levelled(evidence, Model(mu_s=0.3)), ())
    start = Term(effect, {**effect.neutral(), "per_e_fold": 0.02, "slower_decades": 7.0})
    found = fit(evidence, plain.model.with_term(start), [effect], noise=plain.noise)
    assert found.model.mu_s < 0.35, "at rest it would be less"
    assert level_of(evidence, found).value == pytest.approx(float(np.median(friction)), rel=0.01)
