"""Slopes of some effects out of those of many are the slopes that they have alone."""

from __future__ import annotations

import numpy as np

from station.diagnosis.inference.columns import looked
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.table import table_evidence
from station.physics.catalogue import catalogue
from station.physics.model import Model
from tests.unit.diagnosis.tables import MU, samples


def test_some_of_many_are_what_they_are_alone() -> None:
    """Effects are chosen in another order than they were looked at; columns are numbered anew."""
    evidence, model, known = table_evidence(samples(runs=40), Setting()), Model(mu_s=MU), catalogue()
    many = [known[name] for name in ("contact_aging", "viscous", "wear", "plate_anisotropy")]
    few = [many[3], many[1]]
    chosen, alone = looked(evidence, model, many).of(few), looked(evidence, model, [many[1], many[3]])
    assert [one.effect.id for one in chosen.variants] == [one.effect.id for one in alone.variants]
    assert [one.columns for one in chosen.variants] == [one.columns for one in alone.variants]
    np.testing.assert_array_equal(chosen.table.rows.whole(), alone.table.rows.whole())
    np.testing.assert_array_equal(chosen.low, alone.low)
    np.testing.assert_array_equal(chosen.high, alone.high)


def test_of_none_there_is_no_column() -> None:
    """There is a row for each row of the evidence, and no column."""
    evidence = table_evidence(samples(runs=20), Setting())
    seen = looked(evidence, Model(mu_s=MU), ())
    assert seen.variants == ()
    assert seen.table.rows.shape == (sum(len(channel) for channel in evidence.channels), 0)
