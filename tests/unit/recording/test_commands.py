"""The commands `samples` and `repair`, as they are called."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from types import ModuleType

import pytest

from shared.errors import UserError
from shared.messages import Sample
from station.app.attached import attached_rig
from station.app.commands import repair, samples
from station.recording.measured import read_measured
from station.recording.reader import digest, open_recording
from station.recording.repair import copy_without
from station.recording.tables import read_samples, write_samples
from station.recording.writer import Recording, partial_path
from tests.unit.recording import session


def call(command: ModuleType, *words: str | Path) -> int:
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    return command.run(parser.parse_args([str(word) for word in words]))


def test_samples_are_printed_and_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = session.record(tmp_path / "a.mcap")
    tables = (tmp_path / "a.csv", tmp_path / "a.parquet")
    assert call(samples, path, "--csv", tables[0], "--parquet", tables[1]) == 0
    said = capsys.readouterr().out
    assert "11.46" in said, "0.2 rad"
    assert "no slip" in said
    assert [read_samples(table) for table in tables] == [open_recording(path).samples()] * 2
    assert call(samples, tables[0]) == 0
    assert capsys.readouterr().out.splitlines()[:5] == said.splitlines()[:5], "a table prints as its recording does"


def test_the_truth_changes_no_word(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = session.record(tmp_path / "a.mcap")
    copy_without(path, tmp_path / "b.mcap", drop=lambda topic: topic.startswith("truth/"))
    said: list[str] = []
    for file in (path, tmp_path / "b.mcap"):
        call(samples, file)
        call(samples, file, "--digest")
        said.append(capsys.readouterr().out)
    assert said[0] == said[1]
    assert digest(open_recording(path)) in said[0]


def test_of_many_samples_the_ends_are_shown_and_all_on_demand(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    many = tmp_path / "many.csv"
    write_samples([Sample(run=1000 + run, onset_angle_rad=0.3) for run in range(30)], many)
    assert call(samples, many) == 0
    few = capsys.readouterr().out
    shown = [run for run in range(30) if str(1000 + run) in few]
    assert shown == [*range(10), *range(20, 30)]
    assert "10 more" in few
    assert call(samples, many, "--all") == 0
    everything = capsys.readouterr().out
    assert all(str(1000 + run) in everything for run in range(30))
    assert "more" not in everything


def test_no_samples_are_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Recording(tmp_path / "a.mcap", provenance=session.provenance()).close()
    assert call(samples, tmp_path / "a.mcap") == 0
    assert "holds no samples" in capsys.readouterr().out


def test_repair_of_a_file_and_of_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("a", "b"):
        path = session.record(tmp_path / f"{name}.mcap")
        partial_path(path).write_bytes(path.read_bytes()[:-500])
        path.unlink()
    assert call(repair, tmp_path / "a.mcap.partial") == 0
    assert "a.mcap: " in capsys.readouterr().out
    assert call(repair, tmp_path) == 0
    assert "b.mcap: " in capsys.readouterr().out
    assert len(open_recording(tmp_path / "b.mcap").samples()) == 2
    assert call(repair, tmp_path) == 0
    assert "Nothing to repair" in capsys.readouterr().out
    with pytest.raises(UserError, match="--out"):
        call(repair, tmp_path, "--out", tmp_path / "c.mcap")
    with pytest.raises(UserError, match="no file"):
        call(repair, tmp_path / "none.mcap.partial")


def test_a_table_of_a_recording_says_how_far_the_blocks_lay_from_the_foam(tmp_path: Path) -> None:
    recorded = Path(__file__).parents[2] / "golden" / "session.mcap"
    assert call(samples, recorded, "--csv", tmp_path / "a.csv", "--parquet", tmp_path / "a.parquet") == 0
    each = [read_measured(tmp_path / name).column("foam_free_m") for name in ("a.csv", "a.parquet")]
    assert each[0].tolist() == each[1].tolist()
    rig = attached_rig(open_recording(recorded))
    assert rig is not None
    corner = 0.5 * math.sqrt(2) * rig.block.size_m[0]
    for sample, free_m in zip(open_recording(recorded).samples(), each[0], strict=True):
        place_m = math.hypot(sample.start_x_m, sample.start_y_m)
        assert free_m == pytest.approx(0.5 * rig.plate.opening_m - place_m - corner)
