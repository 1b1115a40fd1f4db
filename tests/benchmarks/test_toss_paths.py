"""The law that is found in one half of the real tosses of a cube is judged by the paths of the other half.

    REPOSE_CUBE_TOSSES=tosses.parquet pytest -m benchmark -s tests/benchmarks/test_toss_paths.py

Each half is searched anew and predicts the other. A slide of the other half is simulated again by the plain model and
by the one that was found, from where its evidence starts, and compared with the camera's track after that.
TOSSES_SPLITS says how often the tosses are split (2).
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from shared.geometry import Array
from station.app.setting import setting_of
from station.app.simulating import rig_of
from station.diagnosis.inference.determined import determined
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.predict.resimulated import slide_errors
from station.diagnosis.result import Value
from station.diagnosis.search.search import Search, in_stages, search
from station.physics.catalogue import catalogue
from station.physics.contact import Bools
from station.physics.model import Model
from station.recording.arrays import load_signals
from station.recording.importers import cube_tosses, write
from station.recording.reader import open_recording

REAL = Path(os.environ.get("REPOSE_CUBE_TOSSES", ""))
SPLITS = int(os.environ.get("TOSSES_SPLITS", "2"))
KEPT = 0.95
"""The share of the paths, the best ones, whose root mean square is taken: some tosses hit something or are lost."""
LEAST = 0.15
"""A law that is right has to lower the error of paths that it has not seen by at least so much."""
SLOPE = (0.018, 0.026)
"""The slope of the sliding friction per e-fold of speed; within the tosses' windows a regression finds .021 to .022."""

needs_data = pytest.mark.skipif(not REAL.is_file(), reason="REPOSE_CUBE_TOSSES does not name the table of tosses")


def evidence_at(path: Path, folder: Path) -> Evidence:
    """The tosses' evidence, as `station diagnose` reads it."""
    write(cube_tosses.read(path), folder / "tosses.mcap")
    reader = open_recording(folder / "tosses.mcap")
    return evidence_of(load_signals(reader), setting_of(rig_of(reader)))


def found_in(evidence: Evidence, left_out: Bools) -> Search:
    """The search of the runs that are not left out."""
    start, rng = Model(mu_s=0.4), np.random.default_rng(1)
    part = evidence.without(left_out)
    staged = in_stages(part, tuple(catalogue().values()), start=start, rng=rng, progress=lambda _: None)
    return search(staged, rng, lambda _: None)


def slope_of(evidence: Evidence, found: Search) -> Value:
    """The slope of the sliding friction per e-fold of speed."""
    told = [one for term in found.model.model.terms for one in determined(evidence, found.model, term)]
    (slope,) = [one for one in told if "per e-fold of speed" in one.expression]
    return Value(value=slope.value, sd=slope.sd, unit="1")


def trimmed(errors: Array) -> float:
    kept = np.sort(errors[np.isfinite(errors)])
    return 1e3 * float(np.sqrt(np.mean(kept[: int(KEPT * len(kept))] ** 2)))


def median(errors: Array) -> float:
    return 1e3 * float(np.nanmedian(errors))


@needs_data
@pytest.mark.benchmark
@pytest.mark.timeout(1800)
def test_the_law_of_one_half_leads_the_other_halfs_paths(tmp_path: Path) -> None:
    evidence = evidence_at(REAL, tmp_path)
    none, lowered = np.zeros(evidence.runs), list[tuple[float, float]]()
    print(f"\n{evidence.used()} tosses that slide; paths of the other half in mm, {KEPT:.0%}-trimmed rms and median")
    for split in range(SPLITS):
        half = np.random.default_rng([20261123, split]).permutation(np.arange(evidence.runs) % 2).astype(np.bool_)
        for unseen in (half, ~half):
            found = found_in(evidence, unseen)
            models = (found.null.model, found.model.model)
            paths = [slide_errors(evidence, one, unseen, run_effects=none).path_m for one in models]
            figures = [(trimmed(each), median(each)) for each in paths]
            lowered.append((1.0 - figures[1][0] / figures[0][0], 1.0 - figures[1][1] / figures[0][1]))
            slope = slope_of(evidence.without(unseen), found)
            print(
                f"split {split}: {int(np.isfinite(paths[0]).sum())} paths, "
                + ", ".join(f"{was:.3f} to {now:.3f}" for was, now in zip(*figures, strict=True))
                + f" ({lowered[-1][0]:.0%}, {lowered[-1][1]:.0%} less); "
                + f"{', '.join(one.id for one in found.found)}; slope per e-fold {slope}",
                flush=True,
            )
            assert SLOPE[0] < slope.value < SLOPE[1]
            assert slope.sd < 0.1 * slope.value
    both = np.mean(lowered, axis=0)
    print(f"mean of {len(lowered)}: trimmed rms {both[0]:.1%} less, median {both[1]:.1%} less (at least {LEAST:.0%})")
    assert (both >= LEAST).all()
