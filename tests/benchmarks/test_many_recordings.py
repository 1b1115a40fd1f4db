"""Reading 200 recordings scales over processes: `pytest -m benchmark -s` and this file, alone on the machine.

Printed are ratios: the time of one process over that of several, for `station doctor` over copies of a session (reading
and checking every message), and the time of a first call over that of a second, which finds its results.
"""

from __future__ import annotations

import shutil
import time
from functools import partial
from pathlib import Path

import pytest

from shared.system.processes import usable_processors
from station.app.many.checkups import checked
from station.app.many.each import Kept, Row, each
from tests.unit.diagnosis.recorded import GOLDEN

COUNT = 200

pytestmark = pytest.mark.benchmark


def timed(names: list[str], *, jobs: int, kept: Kept | None = None) -> tuple[float, list[Row]]:
    """The time that all take (s), processes included that are started anew, and the rows."""
    begin = time.perf_counter()
    rows = each(names, partial(checked, with_digest=True), kept=kept, jobs=jobs)
    return time.perf_counter() - begin, rows


def test_two_hundred_recordings_over_processes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = [str(shutil.copy(GOLDEN, tmp_path / f"{number}.mcap")) for number in range(COUNT)]
    alone_s, expected = timed(names, jobs=1)
    lines = [f"{COUNT} recordings, one process: {alone_s:.1f} s, {1e3 * alone_s / COUNT:.0f} ms each"]
    for jobs in sorted({2, usable_processors(), 2 * usable_processors()}):
        seconds, rows = timed(names, jobs=jobs)
        assert [row.result["digest"] for row in rows] == [row.result["digest"] for row in expected]
        lines.append(f"{jobs} processes: {alone_s / seconds:.2f} times as fast")
    kept = Kept(folder=tmp_path / "out", key="0" * 64)
    timed(names, jobs=1, kept=kept)
    again_s, rows = timed(names, jobs=1, kept=kept)
    assert {row.status for row in rows} == {"kept"}
    lines.append(f"results that are there already, one process: {alone_s / again_s:.0f} times as fast")
    with capsys.disabled():
        print("", *lines, sep="\n")
