"""All readers of tables read the same cells: whatever separates them, and whatever else a table has."""

from __future__ import annotations

import sys
import tracemalloc
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from shared.errors import UserError
from station.recording import cells
from station.recording.cells import cells_of, numbers_of
from station.recording.measured import read_measured
from station.recording.tables import read_samples

ROWS = (
    ("onset_angle_rad", "euler_rad_0", "object", "sliding_speed_m_s"),
    (0.25, 1e-3, "A, B", 1.5),
    (0.5, -0.1, "C", 2.0),
)


def table(folder: Path, between: str, point: str) -> Path:
    path = folder / "a.csv"
    lines = [[cell if isinstance(cell, str) else str(cell).replace(".", point) for cell in row] for row in ROWS]
    path.write_text("\n".join(between.join(line) for line in lines) + "\n\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(("between", "point"), [(";", ","), (";", "."), ("\t", ".")])
def test_tables_of_spreadsheets_are_read_as_samples_and_as_measurements(
    between: str, point: str, tmp_path: Path
) -> None:
    path = table(tmp_path, between, point)
    first, second = read_samples(path)
    assert (first.onset_angle_rad, first.euler_rad, first.object) == (0.25, (1e-3,), "A, B")
    assert (second.onset_angle_rad, second.euler_rad, second.object) == (0.5, (-0.1,), "C")
    assert read_measured(path).more["sliding_speed_m_s"].tolist() == [1.5, 2.0]


def test_a_row_of_another_length_is_no_sample(tmp_path: Path) -> None:
    """A decimal comma between commas shifts every cell behind it: 0,25 is no angle of 0."""
    path = tmp_path / "a.csv"
    path.write_text("onset_angle_rad,run\n0.3,1\n0,25,2\n", encoding="utf-8")
    for read in (read_samples, read_measured):
        with pytest.raises(
            UserError, match=r"row 2: expected 2 cells between commas, .* got 3; numbers with a decimal"
        ):
            read(path)


def test_a_table_of_too_many_cells_is_refused_as_it_is_read(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(cells, "MOST_CELLS", 11)
    path = tmp_path / "a.csv"
    path.write_text("onset_angle_rad,run\n" + "0.3,1\n" * 5, encoding="utf-8")
    assert len(read_samples(path)) == 5
    path.write_text("onset_angle_rad,run\n" + "0.3,1\n" * 6 + "no row", encoding="utf-8")
    with pytest.raises(UserError, match="at most 11 cells"):
        read_samples(path)


@pytest.mark.parametrize(
    ("name", "most", "said"), [("MOST_ROWS", 5, "at most 5 rows"), ("MOST_BYTES", 40, "at most 0 MB in .*, it holds 0")]
)
def test_a_table_of_too_many_rows_or_letters_is_refused(
    name: str, most: int, said: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(cells, name, most)
    path = tmp_path / "a.csv"
    path.write_text("run,t_s\n" + "1,0\n" * 5, encoding="utf-8")
    assert cells_of(path, what="tracks")["run"] == ["1"] * 5
    path.write_text("run,t_s\n" + "1,0\n" * 6 + "1,0\n" * 6, encoding="utf-8")
    with pytest.raises(UserError, match=said):
        cells_of(path, what="tracks")


def test_a_table_is_never_in_memory_as_rows_and_as_columns(tmp_path: Path) -> None:
    """The rows of a table of three columns took half as much again as its cells."""
    path, rows = tmp_path / "a.csv", 20_000
    path.write_text("a,b,c\n" + "".join(f"0.{row},1.{row},2.{row}\n" for row in range(rows)), encoding="utf-8")
    tracemalloc.start()
    try:
        kept = cells_of(path, what="tracks")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    cells_bytes = sum(sys.getsizeof(cell) for column in kept.values() for cell in column)
    lists_bytes = sum(sys.getsizeof(column) for column in kept.values())
    assert peak < 1.1 * (cells_bytes + lists_bytes)


def test_only_columns_that_are_asked_for_must_be_readable(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    far = pa.array([2**62], pa.timestamp("us"))
    pq.write_table(pa.table({"onset_angle_rad": [0.3], "when": far}), path)
    assert read_samples(path)[0].onset_angle_rad == 0.3
    assert read_measured(path).ignored == ("when",)
    with pytest.raises(UserError, match="in the column 'when'"):
        cells_of(path, what="samples")["when"]


class Counted(str):
    """The name of a column that counts how often it is compared with others."""

    compared = 0
    __hash__ = str.__hash__

    def __eq__(self, other: object) -> bool:
        Counted.compared += 1
        return str.__eq__(self, other)


def test_the_names_of_columns_are_not_compared_each_with_each() -> None:
    """The names of 20 000 columns were, which took 9 s."""
    Counted.compared = 0
    cells._require_once([Counted(number) for number in range(1000)], Path("a.csv"))  # pyright: ignore[reportPrivateUsage]
    assert Counted.compared < 10_000


def test_a_column_that_is_there_twice_is_refused(tmp_path: Path) -> None:
    """Nobody knows which of the two is meant."""
    columns = [[0.3], [0.4]]
    pq.write_table(pa.table(columns, names=["onset_angle_rad"] * 2), tmp_path / "a.parquet")
    (tmp_path / "a.csv").write_text("onset_angle_rad,onset_angle_rad\n0.3,0.4\n", encoding="utf-8")
    for name in ("a.parquet", "a.csv"):
        with pytest.raises(UserError, match="2 times"):
            read_samples(tmp_path / name)


def test_numbers_are_finite_and_within_what_is_asked(tmp_path: Path) -> None:
    assert numbers_of(["1", "", None, "-2e3"], "x", tmp_path)[[0, 3]].tolist() == [1.0, -2000.0]
    for cell, said in (("one", "expected a number for 'x', got 'one'"), ("-inf", "finite 'x', got -inf")):
        with pytest.raises(UserError, match=f"row 1: .*{said}"):
            numbers_of([cell], "x", tmp_path)
    with pytest.raises(UserError, match="finite 'x' of at least 0, got -1"):
        numbers_of([-1], "x", tmp_path, least=0.0)
