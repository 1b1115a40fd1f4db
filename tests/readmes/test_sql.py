"""Every block of SQL runs as it stands in DuckDB, on a dataset of samples, and gives what Python computes from them."""

from __future__ import annotations

import math
import statistics
from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from shared.messages import Sample
from station.__main__ import main
from station.recording.summary import is_kept
from station.recording.tables import read_samples, write_samples
from station.recording.writer import Recording
from tests.readmes.blocks import Block, blocks
from tests.unit.diagnosis.tables import samples
from tests.unit.recording.session import START_NS, provenance

Rows = list[tuple[Any, ...]]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a dataset of two rigs' recordings and a table."""
    here = tmp_path_factory.mktemp("sql")
    for rig, seed in (("bench", 1), ("bench", 2), ("lab", 3)):
        _record(samples(seed=seed), here / f"{rig}-{seed}.mcap", rig=rig, seed=seed)
    write_samples(samples(seed=4), here / "table.csv")
    assert main(["samples", str(here / "*.*"), "--out", str(here / "dataset")]) == 0
    return here


def _record(every: Sequence[Sample], path: Path, *, rig: str, seed: int) -> None:
    with Recording(path, provenance=provenance(rig_id=rig, seed=seed)) as recording:
        for sample in every:
            recording.write_message("session/sample", sample, receive_ns=START_NS + sample.run)


def kept(folder: Path) -> dict[tuple[str | None, str], list[Sample]]:
    """The kept runs of each recording, by its rig and its file."""
    rigs = {path: path.stem.partition("-")[0] for path in sorted(folder.glob("*.mcap"))} | {folder / "table.csv": None}
    return {(rig, str(path)): [one for one in read_samples(path) if is_kept(one)] for path, rig in rigs.items()}


def by_direction(rows: Rows, folder: Path) -> None:
    onsets = defaultdict[tuple[str | None, int], list[float]](list)
    for (rig, _), every in kept(folder).items():
        for sample in every:
            onsets[rig, sample.direction].append(math.degrees(sample.onset_angle_rad))
    assert {row[:2]: row[2] for row in rows} == {key: len(values) for key, values in onsets.items()}
    for rig, direction, _, mean_deg, sd_deg in rows:
        values = onsets[rig, direction]
        assert mean_deg == pytest.approx(statistics.fmean(values))
        assert sd_deg == pytest.approx(statistics.stdev(values))


def by_session(rows: Rows, folder: Path) -> None:
    expected = kept(folder)
    assert {(row[0], row[3]) for row in rows} == set(expected)
    assert {Path(row[3]).stem.partition("-")[2] for row in rows} == {str(row[2] or "") for row in rows}
    for rig, _, _, recording, runs, change in rows:
        every = expected[rig, recording]
        x, y = [one.run for one in every], [math.log(math.tan(one.onset_angle_rad)) for one in every]
        assert (runs, change) == (len(every), pytest.approx(np.polyfit(x, y, 1)[0]))
    changes = [abs(row[5]) for row in rows]
    assert changes == sorted(changes, reverse=True)


GIVES: dict[str, Callable[[Rows, Path], None]] = {"mean_deg": by_direction, "change_a_run": by_session}
"""The check of the block that has this word."""


@pytest.mark.parametrize("block", blocks("sql"), ids=lambda block: block.readme)
def test_it_gives_what_python_computes(block: Block, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    (check,) = (check for word, check in GIVES.items() if word in block.text)
    duckdb: Any = pytest.importorskip("duckdb")
    with duckdb.connect() as database:
        check(database.execute(block.text).fetchall(), folder)
