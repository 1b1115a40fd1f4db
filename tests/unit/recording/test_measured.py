"""Tables of friction measurements are read with all that they say, and what nothing reads is named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from shared.errors import UserError
from station.recording.measured import read_measured


def written(folder: Path, text: str) -> Path:
    path = folder / "a.csv"
    path.write_text(text)
    return path


def test_a_tribometers_columns_are_read(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        "run,normal_load_n,sliding_speed_m_s,friction_coefficient,specimen,day,operator\n"
        "1,0.5,0.01,0.4,a,3,Kim\n2,,0.02,0.5,b,3,Lee\n",
    )
    table = read_measured(path)
    assert [sample.run for sample in table.samples] == [1, 2]
    assert table.column("friction_coefficient").tolist() == [0.4, 0.5]
    assert table.column("normal_load_n")[0] == 0.5
    assert np.isnan(table.column("normal_load_n")[1])
    assert np.isnan(table.column("time_s")).all()
    assert table.group == ("3 a", "3 b")
    assert table.ignored == ("operator",)


def test_parquet_says_the_same(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    columns = {"friction_force_n": [0.2, 0.3], "normal_load_n": [1.0, 2.0], "sequence": [1, 2], "cycle": [1, 1]}
    pq.write_table(pa.table(columns), path)
    table = read_measured(path)
    assert table.column("friction_force_n").tolist() == [0.2, 0.3]
    assert table.group == ("1", "2")
    assert table.ignored == ("cycle",)


def test_single_rows_may_be_beyond_all_benches(tmp_path: Path) -> None:
    rows = "onset_angle_rad,friction_coefficient\n0.3,\n0.3,\n17,\n,0.4\n,0.4\n,30\n"
    assert len(read_measured(written(tmp_path, rows))) == 6


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("normal_load_n,plate\n1,2\n", "'onset_angle_rad' or 'friction_coefficient' or 'friction_force_n'"),
        ("friction_coefficient\nhigh\n", r"row 1: expected a number for 'friction_coefficient', got 'high'"),
        ("friction_coefficient,normal_load_n\n0.3,-1\n", r"row 1: expected a finite 'normal_load_n' of at least 0"),
        ("friction_coefficient,time_s\n0.3,inf\n", "expected a finite 'time_s'"),
        (
            "onset_angle_rad\n17.1\n0.3\n19.2\n",
            r"a\.csv: expected at most 1\.571 rad in 'onset_angle_rad', .* got 17\.1 rad as .*; did you mean degrees",
        ),
        (
            "friction_coefficient\n30\n29\n0.3\n",
            r"a\.csv: expected at most 5 in 'friction_coefficient', .* got 29 as .*; did you mean per cent",
        ),
        ("friction_force_n\n0.3\n", "'normal_load_n' beside 'friction_force_n'"),
    ],
)
def test_bad_tables_are_one_sentence(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=words):
        read_measured(written(tmp_path, text))


def test_a_tilt_and_a_coefficient_that_contradict_each_other_are_told(tmp_path: Path) -> None:
    table, said = (
        tmp_path / "a.csv",
        r"row 2: expected one friction, got 0.6 in 'friction_coefficient' and 0.4 by the tilt",
    )
    table.write_text("onset_angle_rad,friction_coefficient\n0.3805,0.40\n0.3805,0.60\n0.3805,0.60\n", encoding="utf-8")
    with pytest.raises(UserError, match=said):
        read_measured(table)
    table.write_text("onset_angle_rad,friction_coefficient\n0.3805,0.40\n0.3805,\n", encoding="utf-8")
    assert len(read_measured(table)) == 2


def test_friction_at_rest_and_while_sliding_may_stand_in_one_row(tmp_path: Path) -> None:
    rows = "".join("0.3805,0.33,0.05\n" for _ in range(3))
    (tmp_path / "a.csv").write_text(f"onset_angle_rad,friction_coefficient,sliding_speed_m_s\n{rows}", encoding="utf-8")
    assert len(read_measured(tmp_path / "a.csv")) == 3
