"""Exported models are compared with our own simulation; run with `pytest -m benchmark -s` and this file.

For each engine that is installed and each model: the worst onset and path of eight directions.
"""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest

from station.export.deviation import deviations
from tests.recovery.test_exported_models import MODULES
from tests.unit.export.models import TEXTS, TURNS, file_of, model_of

DIRECTIONS = np.radians(np.arange(0, 360, 45) + 10.0).tolist()
CASES = {**TEXTS, "turns": TURNS}


@pytest.mark.benchmark
@pytest.mark.parametrize("name", MODULES)
def test_deviation_by_model(name: str) -> None:
    if importlib.util.find_spec(MODULES[name]) is None:
        pytest.skip(f"{name} is not installed (pip install --group engines)")
    print(f"\n{name}: {'model':<20} {'onset deg':>10} {'path mm':>8} {'of mm':>7} {'turn deg':>9} {'of deg':>7}")
    for case, text in CASES.items():
        model = model_of(text)
        found = deviations(file_of("tried", model, name), model, DIRECTIONS)
        onset = max((one.onset_deg for one in found), key=abs)
        path = max(found, key=lambda one: one.path_mm)
        turn = max(found, key=lambda one: abs(one.turn_deg))
        print(f"{name}: {case:<20} {onset:>+10.4f} {path.path_mm:>8.3f} {path.gone_mm:>7.2f}", end=" ")
        print(f"{turn.turn_deg:>+9.3f} {turn.turned_deg:>+7.2f}", flush=True)
        assert np.isfinite(onset)
