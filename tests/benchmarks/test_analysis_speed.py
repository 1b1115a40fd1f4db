"""The time of `station analyze` over 10 000 runs is taken: `pytest -m benchmark -s`, alone on the machine.

Two times are printed. The whole command over a table of 10 000 made-up runs of four surface pairs: filters, tests,
limit curves, figures, report and Rerun. And reading: a simulated session's recording, copied, read with all cores; the
time for 10 000 runs follows from that of the runs read.
"""

from __future__ import annotations

import math
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.messages import Sample
from station.__main__ import main
from station.app.sessions import read_sessions
from station.recording.tables import write_samples
from tests.unit.friction.sessions import session

RUNS = 10_000
SIMULATED, COPIES = 20, 16
PAIRS = {("steel", "steel"): (0.36, 0.2), ("wood", "wood"): (0.41, 0.1), ("steel", "wood"): (0.2, 0.1)}
PAIRS[("wood", "steel")] = (0.2, 0.1)

pytestmark = pytest.mark.benchmark


def made_up() -> list[Sample]:
    """The runs of four pairs; wood on wood has an ellipse."""
    rng = np.random.default_rng(1)
    found: list[Sample] = []
    for (above, below), (mu, scatter) in PAIRS.items():
        swing = 0.14 if above == below == "wood" else 0.0
        runs = session(
            RUNS // len(PAIRS),
            rng=rng,
            mu=lambda phi, mu=mu, swing=swing: mu * math.exp(swing * math.cos(2 * phi)),
            scatter=scatter,
        )
        found += [replace(one, object=above, plate=below) for one in runs]
    return found


def test_ten_thousand_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = tmp_path / "runs.parquet"
    write_samples(made_up(), table)
    begin = time.perf_counter()
    command = [sys.executable, "-m", "station", "analyze", str(table), "--out", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    analysing_s = time.perf_counter() - begin
    assert done.returncode in (0, 1), done.stderr  # 1: the table has no calibration
    assert (tmp_path / "out" / "report.html").stat().st_size > 1e6

    first = tmp_path / "0.mcap"
    assert main(["run", "--lockstep", "--samples", str(SIMULATED), "--out", str(first)]) == 0
    copies = [first, *(Path(shutil.copy(first, tmp_path / f"{number}.mcap")) for number in range(1, COPIES))]
    begin = time.perf_counter()
    read = sum(len(one.samples) for one in read_sessions(copies))
    reading_s = time.perf_counter() - begin
    assert read == SIMULATED * COPIES
    scaled_s = reading_s / read * RUNS
    with capsys.disabled():
        print(f"\n{RUNS} runs of {len(PAIRS)} pairs: {analysing_s:.1f} s for the whole command over a table")
        print(f"{read} runs read from {COPIES} recordings in {reading_s:.1f} s: {scaled_s:.1f} s for {RUNS}")
        print(f"together {analysing_s + scaled_s:.1f} s")
