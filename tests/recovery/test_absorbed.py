"""Causes that a recording cannot show are allowed for: they get no other name, and do not feed on the scatter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from station.diagnosis.inference.fit import fit
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.table import table_evidence
from station.diagnosis.search.search import in_stages, search
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term
from tests.recovery.test_parameters import MU, SCATTER, evidence
from tests.unit.diagnosis.tables import samples

RUNS = 200


def test_an_absorbed_adhesion_is_given_no_other_name() -> None:
    """A third of the block's weight, one mass: slides show it by a per cent as the plate returns."""
    known = catalogue()
    truth = Model(mu_s=MU, scatter=SCATTER).with_term(Term(known["adhesion"], {"force_n": 0.03}))
    effects = [effect for effect in known.values() if effect.layer != "numerics"]
    rng = np.random.default_rng(5)
    seen = evidence(truth, np.random.default_rng(11))
    staged = in_stages(seen, effects, start=Model(mu_s=0.3), rng=rng, progress=lambda _: None)
    found = search(staged, rng, lambda _: None)
    assert "adhesion" in found.untestable
    assert found.named == ()


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_law_of_the_load_is_not_fitted_to_the_scatter(seed: int) -> None:
    """The load falls with the tilt, which is what a run's own friction made of it."""
    table = [replace(one, block_mass_kg=0.008) for one in samples(runs=RUNS, seed=seed)]
    known, seen = catalogue()["load_dependence"], table_evidence(table, Setting())
    plain = fit(seen, Model(mu_s=0.3), ())
    found = fit(
        seen, plain.model.with_term(Term(known, {**known.neutral(), "exponent": 0.1})), [known], noise=plain.noise
    )
    assert found.log_likelihood - plain.log_likelihood < 0.5
