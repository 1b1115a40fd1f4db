"""The memory that the largest table in a CSV file takes; `pytest -m benchmark -s` prints it.

Each shape is read in a process of its own, because memory that was once taken is not given back.
"""

from __future__ import annotations

import multiprocessing
from pathlib import Path

import pytest

from station.recording.cells import cells_of
from station.recording.parquet import MOST_CELLS, MOST_ROWS
from tests.fuzz.trial import peak_bytes

pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(1800)]

CELL = "0.{:09d}"
MOST_MB = 1000.0


def write(path: Path, *, columns: int) -> int:
    """Writes as many cells of eleven letters, no two alike, as a table may have; gives their number."""
    rows = min(MOST_ROWS, MOST_CELLS // columns)
    with path.open("w", encoding="utf-8") as file:
        file.write(",".join(f"c{column}" for column in range(columns)) + "\n")
        for row in range(rows):
            file.write(",".join(CELL.format(row * columns + column) for column in range(columns)) + "\n")
    return rows * columns


def measure(path: Path) -> float:
    """The largest memory of this process in MB."""
    cells_of(path, what="tracks")
    return peak_bytes() / 1e6


@pytest.mark.parametrize("columns", [3, 10, 5000])
def test_the_largest_table_takes_less_than_a_gigabyte(columns: int, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    count = write(path, columns=columns)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        peak = pool.apply(measure, (path,))
    print(f"\n{count} cells in {columns} columns, {path.stat().st_size / 1e6:.0f} MB: {peak:.0f} MB")
    assert peak < MOST_MB
