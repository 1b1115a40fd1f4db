"""Smooth terms of one covariate are one finding: their sum is one function of it."""

from __future__ import annotations

import numpy as np
import pytest

from station.diagnosis.diagnose import examined
from station.diagnosis.report.sentences import sentence
from station.physics.catalogue import catalogue
from station.recording.measured import Measured
from tests.unit.diagnosis.test_measured_tables import measured

DAYS, ROWS = 8, 15


def by_days() -> Measured:
    """Friction with a level of each day, of which no column tells."""
    rng = np.random.default_rng(5)
    level = np.repeat(rng.normal(0.0, 0.1, DAYS), ROWS)
    friction = 0.35 * np.exp(level + rng.normal(0.0, 0.02, DAYS * ROWS))
    return measured({"friction_coefficient": friction}, run=np.arange(DAYS * ROWS))


def test_levels_that_no_column_tells_are_one_change_with_the_order() -> None:
    found = examined(by_days(), catalogue())
    assert found.found is not None
    assert len(found.found.search.found) > 1, "the search needs several terms, or this tests nothing"
    (claimed,) = (one for one in found.diagnosis.effects if one.verdict != "not supported")
    assert sentence(found.diagnosis).count("order of measuring") == 1
    assert claimed.class_ids == ("other",)
    (change,) = claimed.determined
    assert change.value == pytest.approx(0.2, abs=0.08)
    assert 0.005 < change.sd < 0.05
    numbers = sum(len(effect.parameters) for effect in found.found.search.found)
    assert len(claimed.parameters) == numbers
