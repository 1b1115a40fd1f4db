"""The samples of many recordings as a Parquet dataset, which others' readers take as it is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from station.__main__ import main
from station.app.many.dataset import sampled
from station.app.many.each import Kept
from station.recording.tables import read_samples, write_samples
from station.recording.writer import Recording
from tests.unit.friction.sessions import sample
from tests.unit.recording import session

dataset: Any = pytest.importorskip("pyarrow.dataset")


def recorded(path: Path, *, rig: str, seed: int | None, samples: int) -> Path:
    with Recording(path, provenance=session.provenance(rig_id=rig, seed=seed)) as recording:
        for run in range(1, samples + 1):
            one = replace(sample(run=run), start_ns=run)
            recording.write_message("session/sample", one, receive_ns=session.START_NS + run)
    return path


@pytest.fixture
def made(tmp_path: Path) -> Path:
    """A folder `recorded` with two rigs' recordings, a copy of one, and a table."""
    folder = tmp_path / "recorded"
    folder.mkdir()
    one = recorded(folder / "one.mcap", rig="bench", seed=7, samples=2)
    recorded(folder / "two.mcap", rig="../lab 2", seed=None, samples=3)
    (folder / "copy.mcap").write_bytes(one.read_bytes())
    write_samples([sample(run=1)], folder / "table.csv")
    return folder


def rows(folder: Path) -> list[dict[str, Any]]:
    return dataset.dataset(folder, format="parquet", partitioning="hive").to_table().to_pylist()


def test_every_recording_is_there_once_with_rig_session_and_seed(made: Path, tmp_path: Path) -> None:
    out = tmp_path / "set"
    assert main(["samples", str(made / "*"), "--out", str(out), "--format", "parquet"]) == 0
    found = rows(out)
    assert sorted((row["rig"], row["seed"], row["run"]) for row in found if row["rig"]) == [
        *(("../lab 2", None, run) for run in (1, 2, 3)),
        *(("bench", 7, run) for run in (1, 2)),
    ]
    assert {Path(row["recording"]).name for row in found if row["rig"] is None} == {"table.csv"}
    assert len({row["session"] for row in found}) == 3
    assert all(row["session"].startswith("20200913T122640Z-") for row in found if row["rig"])
    inside = {path.resolve().relative_to(out.resolve()).parts[0] for path in out.rglob("*.parquet")}
    assert inside == {"rig=bench", "rig=..%2Flab 2", "rig=__HIVE_DEFAULT_PARTITION__"}


def test_each_file_is_a_table_of_samples_as_well(made: Path, tmp_path: Path) -> None:
    assert main(["samples", str(made / "one.mcap"), "--out", str(tmp_path / "set")]) == 0
    (path,) = (tmp_path / "set").rglob("*.parquet")
    assert read_samples(path) == read_samples(made / "one.mcap")


def test_another_version_takes_the_place_of_the_last(made: Path, tmp_path: Path) -> None:
    for key in ("1" * 64, "2" * 64):
        kept = Kept(folder=tmp_path / "set", key=key)
        told = sampled(made / "one.mcap", "one", dataset=kept, with_digest=False)
        assert [path.relative_to(kept.folder).as_posix() for path in kept.folder.rglob("*.parquet")] == told["files"]
    assert len(rows(tmp_path / "set")) == 2


def test_a_recording_with_another_name_has_it_in_the_dataset(made: Path, tmp_path: Path) -> None:
    out = tmp_path / "set"
    assert main(["samples", str(made / "one.mcap"), "--out", str(out)]) == 0
    renamed = (made / "one.mcap").rename(made / "renamed.mcap")
    assert main(["samples", str(renamed), "--out", str(out)]) == 0
    assert {row["recording"] for row in rows(out)} == {str(renamed)}


def test_a_table_of_one_recording_has_no_use_for_many(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["samples", str(made), "--csv", "all.csv"]) == 2
    assert "the samples of many go to --out FOLDER" in capsys.readouterr().err
