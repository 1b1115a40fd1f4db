"""The tables of a recording: their columns, and the values that the file has."""

from __future__ import annotations

import csv
import math
import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from numpy.typing import NDArray

import station
from shared.messages import MarkerCorners, PlatformState, RunEvent, TiltCommand
from station.__main__ import main
from station.recording.reader import Recorded, open_recording
from station.recording.tables import read_samples
from tests.readmes.blocks import ROOT
from tests.unit.diagnosis.recorded import GOLDEN
from tests.unit.recording import session


def numbered(name: str, count: int) -> str:
    return " ".join(f"{name}_{place}" for place in range(count))


COLUMNS = {
    "samples": f"run start_ns slip_ns detect_ns {numbered('euler_rad', 3)} {numbered('reference_corners_px', 8)} "
    f"{numbered('corner_variance_px2', 8)} {numbered('post_corners_px', 8)} direction azimuth_rad dwell_s "
    "tilt_rate_rad_s onset_angle_rad onset_sigma_rad flags plate_mount_rad block_mass_kg block_area_m2 object plate "
    "temperature_c relative_humidity censored previous_direction rest_ns step_from_rad step_to_rad start_x_m start_y_m "
    "start_yaw_rad foam_free_m",
    "corners": "time_ns run x0_px y0_px x1_px y1_px x2_px y2_px x3_px y3_px dt0_ns dt1_ns dt2_ns dt3_ns sigma_px "
    "found tipped seq boot_id",
    "poses": "time_ns run x_m y_m yaw_rad flat",
    "attitude": "time_ns run tilt_rad qw qx qy qz wx_rad_s wy_rad_s wz_rad_s pivot_x_m pivot_y_m pivot_z_m",
    "events": "time_ns run phase step reason",
    "commands": "time_ns run direction azimuth_rad angle_rad step rate_rad_s",
    "motions": "time_ns end_ns run step failed",
    "environment": "time_ns temperature_c relative_humidity",
}
WITHOUT_A_UNIT = {
    *(
        "run",
        "direction",
        "previous_direction",
        "step",
        "seq",
        "boot_id",
        "phase",
        "reason",
        "flags",
        "object",
        "plate",
    ),
    *("censored", "found", "tipped", "flat", "failed", "qw", "qx", "qy", "qz", "relative_humidity"),
}
UNIT = re.compile(r"_(ns|s|m|m2|kg|rad|rad_s|px|px2|c)(_\d)?$")


@pytest.fixture(scope="module")
def recording() -> station.Recording:
    return station.open(GOLDEN)


def messages(topic: str) -> Sequence[Recorded]:
    return list(open_recording(GOLDEN).messages({topic}))


def table(recording: station.Recording, name: str) -> station.Table:
    return getattr(recording, name)


def same(told: Sequence[Any], values: NDArray[Any]) -> bool:
    """True if these are the values to the last bit, nan where they are nan."""
    return np.array_equal(np.array(told, dtype=values.dtype), values, equal_nan=values.dtype.kind == "f")


@pytest.mark.parametrize("name", COLUMNS)
def test_the_columns_are_these_in_every_form(recording: station.Recording, name: str) -> None:
    columns, one = tuple(COLUMNS[name].split()), table(recording, name)
    assert one.columns == columns
    assert tuple(one.to_numpy()) == columns
    assert tuple(one.to_pandas().columns) == columns
    assert tuple(one.to_arrow().column_names) == columns


@pytest.mark.parametrize("name", COLUMNS)
def test_every_column_ends_in_its_unit_or_has_none(name: str) -> None:
    columns = set(COLUMNS[name].split())
    assert {column for column in columns if not UNIT.search(column)} <= WITHOUT_A_UNIT


@pytest.mark.parametrize("name", COLUMNS)
def test_the_page_lists_the_columns(name: str) -> None:
    page = (ROOT / "station" / "README.md").read_text(encoding="utf-8")
    section = page.partition(f"### {name}:")[2].partition("\n##")[0]
    cells = [line.split("|")[1] for line in section.splitlines() if line.startswith("| `")]
    listed = [column for cell in cells for column in listed_in(cell)]
    assert sorted(listed) == sorted(COLUMNS[name].split())


def listed_in(cell: str) -> list[str]:
    """The columns that a cell of the page names; of "a_0 … a_7" all eight."""
    names = re.findall(r"`(\w+)`", cell)
    if "…" not in cell:
        return names
    stem, last = names[1].rsplit("_", 1)
    return [f"{stem}_{place}" for place in range(int(last) + 1)]


@pytest.mark.parametrize("name", COLUMNS)
def test_pandas_and_arrow_have_the_values_and_kinds_of_the_arrays(recording: station.Recording, name: str) -> None:
    one = table(recording, name)
    frame, arrow = one.to_pandas(), one.to_arrow()
    assert len(frame) == arrow.num_rows == len(one)
    for column, values in one.to_numpy().items():
        assert same(frame[column].tolist(), values)
        assert same(arrow[column].to_pylist(), values)
        # Which of its types for text pandas takes is its own choice, and differs between its versions.
        is_text = values.dtype.kind in "OU"
        assert pd.api.types.is_string_dtype(frame[column]) if is_text else frame[column].dtype == values.dtype


def test_the_samples_are_those_of_the_command(recording: station.Recording, tmp_path: Path) -> None:
    assert main(["samples", str(GOLDEN), "--csv", str(tmp_path / "samples.csv")]) == 0
    with (tmp_path / "samples.csv").open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    assert tuple(head) == recording.samples.columns
    for name, written in zip(head, zip(*rows, strict=True), strict=True):
        own = recording.samples[name]
        told = [_PARSED[own.dtype.kind](one) for one in written]
        assert same(told, own), name


_PARSED: dict[str, Callable[[str], Any]] = {"i": int, "f": float, "U": str, "b": lambda one: one == "true"}


def test_every_form_of_a_sample_can_be_written_and_read_again(tmp_path: Path) -> None:
    """A session with flags, a censored run and vectors that are empty: what pandas writes, the commands read."""
    path = session.record(tmp_path / "a.mcap")
    station.open(path).samples.to_pandas().to_csv(tmp_path / "a.csv", index=False)
    assert read_samples(tmp_path / "a.csv") == open_recording(path).samples()


def test_corners_are_the_messages(recording: station.Recording) -> None:
    corners, sent = recording.corners, messages("camera/corners")
    assert corners["time_ns"].tolist() == [item.publish_ns for item in sent]
    for row, item in enumerate(sent):
        mark = item.message
        assert isinstance(mark, MarkerCorners)
        names = [f"{axis}{corner}_px" for corner in range(4) for axis in "xy"]
        expected = mark.corners_px if mark.found else (math.nan,) * 8
        assert [corners[name][row] for name in names] == pytest.approx(expected, nan_ok=True, rel=0, abs=0)
        assert (corners["found"][row], corners["seq"][row]) == (mark.found, mark.seq)
        assert corners["sigma_px"][row] == mark.sigma_px


def test_attitudes_commands_and_events_are_the_messages(recording: station.Recording) -> None:
    fields: dict[str, tuple[str, type[Any], dict[str, str]]] = {
        "attitude": ("arm/platform", PlatformState, {"qw": "qw", "wx_rad_s": "wx", "pivot_z_m": "pz"}),
        "commands": ("arm/command", TiltCommand, {name: name for name in COLUMNS["commands"].split()[1:]}),
        "events": ("session/event", RunEvent, {name: name for name in COLUMNS["events"].split()[1:]}),
    }
    for name, (topic, kind, named) in fields.items():
        one, sent = table(recording, name), messages(topic)
        assert all(isinstance(item.message, kind) for item in sent)
        assert sorted(one["time_ns"].tolist()) == sorted(item.publish_ns for item in sent)
        for column, field in named.items():
            assert one[column].tolist() == [getattr(item.message, field) for item in sent], column


def test_the_plates_tilt_at_the_onsets_is_that_of_the_samples(recording: station.Recording) -> None:
    time_ns, tilt_rad = (recording.attitude[name] for name in ("time_ns", "tilt_rad"))
    at_slip = np.interp(recording.samples["slip_ns"], time_ns, tilt_rad)
    assert at_slip == pytest.approx(recording.samples["onset_angle_rad"], abs=2e-3)


def test_a_run_lies_between_its_events_and_its_pose_begins_where_the_sample_says(recording: station.Recording) -> None:
    events, poses = recording.events.to_pandas(), recording.poses.to_pandas()
    for run, own in poses[poses.run >= 0].groupby("run"):
        spans = events[events.run == run].time_ns
        assert spans.min() <= own.time_ns.min()
        assert own.time_ns.max() < spans.max()
    samples = recording.samples.to_pandas().set_index("run")
    for run, sample in samples.iterrows():
        tilt_ns = sample.rest_ns + round(1e9 * sample.dwell_s)
        before = poses[(poses.run == run) & poses.time_ns.between(sample.rest_ns, tilt_ns)]
        assert before.x_m.median() == pytest.approx(sample.start_x_m, abs=2e-5)
        assert before.yaw_rad.median() == pytest.approx(sample.start_yaw_rad, abs=1e-3)


def test_the_recording_cannot_be_changed_through_a_table(recording: station.Recording) -> None:
    with pytest.raises(ValueError, match="read-only"):
        recording.corners["x0_px"][0] = 0.0
    frame = recording.corners.to_pandas()
    before = float(recording.corners["x0_px"][0])
    frame.loc[0, "x0_px"] = before + 1.0
    assert recording.corners["x0_px"][0] == before


def test_a_table_without_rows_has_its_columns_and_kinds(recording: station.Recording) -> None:
    assert len(recording.environment) == 0
    assert isinstance(recording.environment.to_pandas(), pd.DataFrame)
    assert recording.environment.to_arrow().schema.field("time_ns").type == pa.int64()


@pytest.mark.parametrize(
    ("package", "to", "extra"), [("pandas", "to_pandas", "pandas"), ("pyarrow", "to_arrow", "parquet")]
)
def test_a_missing_extra_is_said_and_arrays_need_none(
    recording: station.Recording, package: str, to: str, extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(station.UserError, match=rf"Expected the package {package}, .* run: .*\[{extra}\]") as said:
        getattr(recording.events, to)()
    assert "\n" not in str(said.value)
    assert len(recording.events.to_numpy()["phase"]) == len(recording.events)
