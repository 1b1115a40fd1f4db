"""Made-up tables of samples, and one diagnosis of such a table that several tests look at."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from shared.messages import Sample
from station.diagnosis.diagnose import Examined
from station.diagnosis.observations.setting import Setting
from station.diagnosis.predict.folds import named
from station.physics.catalogue import catalogue
from station.recording.measured import read_measured
from station.recording.tables import write_samples
from tests.unit.diagnosis.asked_once import examined_once, recommended_once

MU = 0.4
RUNS = 60


def samples(*, runs: int = RUNS, grain: float = 0.0, seed: int = 3, directions: int = 4) -> list[Sample]:
    """Onsets with 3 % scatter; `grain` is the relative amplitude of friction over twice the direction."""
    rng = np.random.default_rng(seed)
    made: list[Sample] = []
    for run in range(runs):
        direction = int(rng.integers(0, directions))
        down_rad = direction * math.pi / 2 - math.pi / 2  # β turns the plate about itself: down is a quarter before it
        mu = MU * (1 + grain * math.cos(2 * down_rad)) * math.exp(rng.normal(0.0, 0.03))
        made.append(
            Sample(
                run=run + 1,
                direction=direction,
                azimuth_rad=direction * math.pi / 2,
                onset_angle_rad=math.atan(mu),
                onset_sigma_rad=0.002,
                tilt_rate_rad_s=math.radians(5.0),
                dwell_s=0.5,
                start_x_m=float(rng.uniform(-0.02, 0.02)),
                start_y_m=float(rng.uniform(-0.02, 0.02)),
                start_yaw_rad=float(rng.normal(0.0, 0.03)),
            )
        )
    return made


@cache
def grained() -> Examined:
    """Returns the diagnosis of a table in which friction depends on the direction by a fifth.

    The same table is `samples.csv` in a reader's folder, and is diagnosed once for all of them.
    """
    with TemporaryDirectory() as folder:
        write_samples(samples(grain=0.2), Path(folder) / "grained.csv")
        table = read_measured(Path(folder) / "grained.csv")
    known = catalogue()
    return recommended_once(
        examined_once(table, known, name="grained.csv", setting=Setting(), seed=1, folding=named), known
    )
