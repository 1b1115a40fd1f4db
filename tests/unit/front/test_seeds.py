"""A seed is a whole number of 0 or more, wherever Python's users give one."""

from __future__ import annotations

from typing import Any

import pytest

import station
from tests.unit.diagnosis.recorded import GOLDEN


@pytest.mark.parametrize("seed", [-1, "a", 1.5, True])
def test_what_is_no_seed_is_said(seed: Any) -> None:
    for ask in (station.diagnose, station.simulate, station.analyze):
        with pytest.raises(station.UserError, match="Expected seed to be a whole number of 0 or more, got"):
            ask(GOLDEN, seed=seed)
