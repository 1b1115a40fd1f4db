"""An arm that reports badly changes the evidence by no more than the rows say, and to no side.

The rows of one concealed session are read with an exact attitude, and again with a noisy one or filtered rates. What
they differ by is what the attitude does, whatever else is wrong with a row.
"""

from __future__ import annotations

import numpy as np
import pytest

from shared.rig import load_rig
from station.app.setting import setting_of
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.setting import Setting
from station.physics.model import Model
from station.signals.session import Signals
from tests.recovery.altered_attitude import Arm, concealed, reported

pytestmark = pytest.mark.timeout(900)

SEED, RUNS = 20261330, 40
TRUSTED = 1e-3
"""A third of what the rows of friction are trusted to together (`FRICTION_TRUSTED`)."""

ARMS = [
    Arm(noise_rad=4e-4),
    Arm(noise_rad=1.6e-3),
    Arm(filtered_s=0.08),
    Arm(noise_rad=4e-4, filtered_s=0.08),
    Arm(noise_rad=1.6e-3, filtered_s=0.08),
]


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> tuple[Signals, Setting, Evidence]:
    signals, rig = concealed(tmp_path_factory.mktemp("altered"), seed=SEED, runs=RUNS)
    setting = setting_of(load_rig(rig))
    return signals, setting, evidence_of(signals, setting)


@pytest.mark.parametrize("arm", ARMS, ids=str)
def test_rows_of_friction_move_by_what_they_say_and_to_no_side(
    arm: Arm, session: tuple[Signals, Setting, Evidence]
) -> None:
    signals, setting, exact = session
    altered = evidence_of(reported(signals, arm, seed=SEED), setting)
    model = Model(mu_s=0.36)
    for name in ("onset", "along", "across"):
        read, true = altered.channel(name), exact.channel(name)
        assert read is not None
        assert true is not None
        assert len(read) == len(true)
        moved = read.residual(model) - true.residual(model)
        assert abs(np.mean(moved)) < TRUSTED, name
        assert np.std(moved) < float(np.median(true.rows.sigma)), name
        if name != "across" and not arm.filtered_s:
            said = np.sqrt(np.mean(read.rows.sigma**2 - true.rows.sigma**2))
            assert 0.5 * said < np.std(moved) < 1.7 * said, name
