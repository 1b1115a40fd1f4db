"""A small Parquet file that would be a large table is refused in a sentence, by all that read one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from shared.errors import UserError
from station.recording import measured, parquet
from station.recording.importers import cube_tosses
from station.recording.importers.tracks.table import read_table
from station.recording.measured import read_measured
from station.recording.parquet import read_parquet
from station.recording.tables import read_samples

READERS: tuple[Callable[[Path], object], ...] = (read_samples, read_measured, read_table, cube_tosses.read)


def repeated(value: Any, rows: int) -> Any:
    """A column of one value, which the file holds once."""
    return pa.DictionaryArray.from_arrays(pa.array(np.zeros(rows, dtype=np.int8)), pa.array([value]))


def written(path: Path, **columns: Any) -> Path:
    pq.write_table(pa.table(columns), path, compression="zstd")
    return path


def test_the_row_numbers_of_pandas_are_no_column(tmp_path: Path) -> None:
    path = written(tmp_path / "a.parquet", onset_angle_rad=[0.3, 0.4], __index_level_0__=[7, 9])
    assert read_parquet(path).column_names == ["onset_angle_rad"]
    assert read_measured(path).ignored == ()


@pytest.mark.parametrize("read", READERS)
def test_more_rows_than_fit_are_refused_before_they_are_read(tmp_path: Path, read: Callable[[Path], object]) -> None:
    path = written(tmp_path / "a.parquet", onset_angle_rad=repeated(0.3, parquet.MOST_ROWS + 1))
    assert path.stat().st_size < 20_000
    with pytest.raises(UserError, match="at most 1000000 rows"):
        read(path)


def test_a_footer_that_says_fewer_rows_than_its_groups_is_not_believed(tmp_path: Path) -> None:
    """pyarrow reads what the groups say."""
    path = written(tmp_path / "a.parquet", onset_angle_rad=repeated(0.3, parquet.MOST_ROWS + 1))
    content = path.read_bytes()
    footer = len(content) - 8 - int.from_bytes(content[-8:-4], "little")
    many, five = bytes.fromhex("168289 7a"), bytes.fromhex("168a80 00")
    path.write_bytes(content[:footer] + content[footer:].replace(many, five, 1))
    assert pq.ParquetFile(path).metadata.num_rows == 5
    with pytest.raises(UserError, match="at most 1000000 rows"):
        read_parquet(path)


def test_items_of_lists_count_as_cells(tmp_path: Path) -> None:
    items = repeated(0.3, parquet.MOST_CELLS + 1).dictionary_decode()
    column = pa.ListArray.from_arrays(pa.array([0, len(items)], pa.int32()), items)
    with pytest.raises(UserError, match="at most 10000000 cells"):
        read_parquet(written(tmp_path / "a.parquet", euler_rad=column))


@pytest.mark.parametrize("read", READERS)
def test_a_table_whose_account_of_its_columns_is_damaged_is_refused(
    tmp_path: Path, read: Callable[[Path], object]
) -> None:
    """pyarrow ends the process that asks for these columns: it throws, and its binding does not catch."""
    path = written(tmp_path / "a.parquet", euler_rad=pa.array([[0.1], [0.2]]))
    optional, required = bytes.fromhex("250218") + b"\x07element", bytes.fromhex("250018") + b"\x07element"
    assert path.read_bytes().count(optional) == 1
    path.write_bytes(path.read_bytes().replace(optional, required))
    with pytest.raises(UserError, match="cannot be counted: Definition level histogram size mismatch"):
        read(path)


@pytest.mark.parametrize("listed", [False, True])
def test_one_long_text_does_not_stand_in_every_row(tmp_path: Path, *, listed: bool) -> None:
    texts = repeated("x" * 1_000_000, 300)
    column = pa.ListArray.from_arrays(pa.array(np.arange(301, dtype=np.int32)), texts) if listed else texts
    path = written(tmp_path / "a.parquet", onset_angle_rad=repeated(0.3, 300), flags=column)
    assert path.stat().st_size < 20_000
    with pytest.raises(UserError, match="at most 268 MB of text"):
        read_samples(path)


@pytest.mark.parametrize("nested", ["record", "map", "list of a length", "record in a list"])
def test_one_long_text_does_not_stand_in_every_record_or_map(tmp_path: Path, nested: str) -> None:
    texts = repeated("x" * 1_000_000, 300)
    record, ends = pa.StructArray.from_arrays([texts], ["a"]), pa.array(np.arange(301, dtype=np.int32))
    match nested:
        case "map":
            column = pa.MapArray.from_arrays(ends, pa.array(["k"] * 300), texts.dictionary_decode())
        case "list of a length":
            column = pa.FixedSizeListArray.from_arrays(texts, 1)
        case "record in a list":
            column = pa.ListArray.from_arrays(ends, record)
        case _:
            column = record
    path = written(tmp_path / "a.parquet", onset_angle_rad=repeated(0.3, 300), note=column)
    assert path.stat().st_size < 20_000
    with pytest.raises(UserError, match="at most 268 MB of text"):
        read_measured(path)


@pytest.mark.parametrize("packed", [{}, {"use_dictionary": False, "column_encoding": {"a": "DELTA_BYTE_ARRAY"}}])
def test_bytes_of_a_fixed_length_do_not_stand_in_every_row(tmp_path: Path, packed: dict[str, Any]) -> None:
    """Their size is known before they are read: 452 bytes took as many gigabytes as they said."""
    path = tmp_path / "a.parquet"
    column = pa.array([bytes(1_000_000)] * 300, pa.binary(1_000_000))
    pq.write_table(pa.table({"a": column}), path, compression="zstd", **packed)
    assert path.stat().st_size < 20_000
    with pytest.raises(UserError, match="at most 268 MB in"):
        read_parquet(path)


COLUMNS = {
    "text": ["x", None, "x"],
    "large": pa.array(["x", "y", None], pa.large_string()),
    "bytes": [b"1", b"2", b"1"],
    "named": pa.array(["a", "b", "a"]).dictionary_encode(),
    "list": [["a", "b"], [], None],
    "lists": [[["a"]], [], [["b", "a"]]],
    "pair": pa.array([["a", "b"]] * 3, pa.list_(pa.string(), 2)),
    "record": [{"p": "q", "n": 1}] * 3,
    "map": pa.array([[("k", "v")]] * 3, pa.map_(pa.string(), pa.string())),
    "number": [0.1, 0.2, None],
}


def test_a_table_is_read_once_and_as_pyarrow_reads_it(tmp_path: Path) -> None:
    path = written(tmp_path / "a.parquet", **COLUMNS)
    assert read_parquet(path).equals(pq.read_table(path))
    views = written(tmp_path / "b.parquet", text=pa.array(["x", "y"], pa.string_view()))
    assert read_parquet(views).column("text").to_pylist() == ["x", "y"]


def test_texts_of_an_honest_table_are_read(tmp_path: Path) -> None:
    flags = pa.array([["a", "b"], [], ["a"]])
    path = written(tmp_path / "a.parquet", onset_angle_rad=[0.1, 0.2, 0.3], object=["x", None, "x"], flags=flags)
    found = read_samples(path)
    assert [sample.object for sample in found] == ["x", "", "x"]
    assert [sample.flags for sample in found] == [("a", "b"), (), ("a",)]


def test_more_measurements_than_a_diagnosis_holds_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path / "a.parquet", onset_angle_rad=[0.1, 0.2, 0.3])
    assert len(read_measured(path).samples) == 3
    monkeypatch.setattr(measured, "MOST_ROWS", 2)
    with pytest.raises(UserError, match=r"at most 2 measurements in .*, it holds .*; split the table"):
        read_measured(path)


def test_a_long_record_is_to_be_thinned_and_not_split(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its rows are neighbours: a part of it says less of how its friction wanders."""
    monkeypatch.setattr(measured, "MOST_ROWS", 2)
    text = "time_s,displacement_m,friction_coefficient\n" + "".join(f"{row},{row},0.3\n" for row in range(5))
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    with pytest.raises(UserError, match="it holds 5; keep one row of 3, as its means are taken anyway"):
        measured.read_measured(tmp_path / "a.csv")
