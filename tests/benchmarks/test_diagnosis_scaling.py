"""Time and memory of a diagnosis grow with the number of runs; `pytest -m benchmark -s` prints the table.

Every size is a process of its own, because memory that was once taken is not given back. SCALING_RUNS names the sizes
("200,1000,5000"), and SCALING_NESTED=1 searches each fold anew (in this process: what it costs, not how long it takes).
An exponent of 1 is growth in proportion to the runs.
"""

from __future__ import annotations

import math
import multiprocessing
import os
import time
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from station.app.diagnosing import diagnose_file
from station.diagnosis.predict.folds import named, nested
from tests.concealed.design import Design, Nuisance, Setting
from tests.concealed.files import rig_toml, write_session
from tests.concealed.session import run_session
from tests.concealed.world import NULL
from tests.fuzz.trial import peak_bytes

pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(3600)]

SIZES = tuple(int(size) for size in os.environ.get("SCALING_RUNS", "200,1000,5000").split(","))
FOLDING = nested if os.environ.get("SCALING_NESTED") else named
LONG_S = 1.0
"""Phases that never take so long are added up under `rest`."""
MOST = 1.3
LONG_RUNS, MOST_MB = 5000, 4000.0
"""A session of so many runs is diagnosed within so much memory, by the line through the measured sizes."""
Phases = dict[str, float]


def record(folder: Path, runs: int) -> Path:
    """A session in which the plate has a grain: something to find, and to fit again and again."""
    world = NULL._replace(grain_plate=0.12, grain_plate_axis=0.4)
    setting = Setting(
        design=Design(runs=runs, wide_steps=22), nuisance=Nuisance(scatter=0.08, noise_px=0.2), world=world
    )
    rig = rig_toml(setting, mu_guess=0.3, scatter_guess=0.1)
    path = folder / f"{runs}.mcap"
    write_session(run_session(setting, np.random.default_rng(1)), path, rig=rig, rng=np.random.default_rng(2))
    return path


def measure(path: Path) -> tuple[Phases, float, str]:
    """Seconds of processor time by phase, the process's largest memory in MB, and what was found."""
    phases, now, last = Phases(), ["start"], [time.process_time()]

    def tell(what: str) -> None:
        moment = time.process_time()
        phases[now[0]] = phases.get(now[0], 0.0) + moment - last[0]
        now[0], last[0] = what.split(":", maxsplit=1)[0].rstrip("0123456789 "), moment

    found = diagnose_file(path, folding=FOLDING, status=tell).diagnosis
    tell("")
    return phases, peak_bytes() / 1e6, f"{found.verdict} {found.names}"


def exponent(sizes: Sequence[int], values: Sequence[float]) -> str:
    """Returns the exponent of the growth from each size to the next, as text."""
    found = (
        f"{math.log(second / first) / math.log(after / before):5.2f}" if first > 0 and second > 0 else "    –"
        for (before, after), (first, second) in zip(pairwise(sizes), pairwise(values), strict=True)
    )
    return " ".join(found)


def test_how_a_diagnosis_grows(tmp_path: Path) -> None:
    measured = list[tuple[Phases, float, str]]()
    context = multiprocessing.get_context("spawn")
    for runs in SIZES:
        path = record(tmp_path, runs)
        with context.Pool(1) as pool:
            measured.append(pool.apply(measure, (path,)))
        print(f"\n{runs} runs, {path.stat().st_size / 1e6:.0f} MB: {measured[-1][2]}", end="")
        path.unlink()
    names = [name for name in measured[-1][0] if max(phases.get(name, 0.0) for phases, *_ in measured) > LONG_S]
    print(f"\n\n{'seconds of processor time':45s}" + "".join(f"{size:9d}" for size in SIZES) + "   exponents")
    rows = {name: [phases.get(name, 0.0) for phases, *_ in measured] for name in names}
    total = [sum(phases.values()) for phases, *_ in measured]
    rows["rest"] = [whole - sum(row[place] for row in rows.values()) for place, whole in enumerate(total)]
    for name, values in {**rows, "all": total, "memory, MB": [memory for _, memory, _ in measured]}.items():
        print(f"{name[:44]:45s}" + "".join(f"{value:9.1f}" for value in values) + f"   {exponent(SIZES, values)}")
    memory = [largest for _, largest, _ in measured]
    in_line = float(np.polyval(np.polyfit(SIZES, memory, 1), LONG_RUNS)) if len(measured) > 1 else memory[-1]
    print(f"memory of {LONG_RUNS} runs, by the line through these: {in_line:.0f} MB")
    assert in_line < MOST_MB
    if len(SIZES) > 1:
        assert math.log(total[-1] / total[0]) / math.log(SIZES[-1] / SIZES[0]) < MOST
