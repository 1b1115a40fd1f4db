"""A published dataset: what is in it, that its header finds its tables, and that nothing is overwritten."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from station.__main__ import main
from station.publish.card import TABLES
from station.publish.tables import ORIGIN
from station.recording.arrays import run_signals
from station.recording.reader import digest, open_recording
from station.simulators.recorded_runs import poses_of

pq = pytest.importorskip("pyarrow.parquet", reason="the extra `parquet` is not installed")
ASKED = ["--license", "cc-by-4.0", "--author", "Doe, Jo", "--author", "Example Lab", "--title", 'A "small" plate']


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Two sessions whose files have one name."""
    folder = tmp_path_factory.mktemp("recorded")
    paths = folder / "a" / "session.mcap", folder / "b" / "session.mcap"
    for seed, path in enumerate(paths, start=1):
        path.parent.mkdir()
        assert main(["run", "--lockstep", "--samples", "2", "--seed", str(seed), "--out", str(path)]) == 0
    return paths


@pytest.fixture(scope="module")
def dataset(recordings: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("published") / "dataset"
    assert main(["publish", *map(str, recordings), "--out", str(out), *ASKED]) == 0
    return out


def header(dataset: Path) -> dict[str, Any]:
    begin, text, _ = (dataset / "README.md").read_text("utf-8").split("---\n", 2)
    assert begin == ""
    return YAML(typ="safe", pure=True).load(text)


def test_the_header_names_licence_and_tables_that_are_there(dataset: Path) -> None:
    told = header(dataset)
    assert told["license"] == "cc-by-4.0"
    assert told["pretty_name"] == 'A "small" plate'
    assert [config["config_name"] for config in told["configs"]] == list(TABLES)
    assert [config.get("default", False) for config in told["configs"]] == [True, False]
    for config in told["configs"]:
        (files,) = config["data_files"]
        assert files["split"] == "train"
        assert (dataset / files["path"]).is_file()


def test_a_row_of_the_samples_is_the_recorded_sample(dataset: Path, recordings: tuple[Path, Path]) -> None:
    rows = pq.read_table(dataset / "data/samples.parquet").to_pylist()
    samples = [sample for path in recordings for sample in open_recording(path).samples()]
    assert len(rows) == len(samples) == 4
    assert list(rows[0])[: len(ORIGIN)] == list(ORIGIN)
    for row, sample in zip(rows, samples, strict=True):
        assert row["onset_angle_rad"] == sample.onset_angle_rad
        assert tuple(row["euler_rad"]) == sample.euler_rad
    assert [row["seed"] for row in rows] == [1, 1, 2, 2]
    assert [row["recording"] for row in rows] == ["session.mcap"] * 2 + ["session-2.mcap"] * 2
    assert len({row["session"] for row in rows}) == 2


def test_a_row_of_the_runs_has_the_blocks_path(dataset: Path, recordings: tuple[Path, Path]) -> None:
    rows = pq.read_table(dataset / "data/runs.parquet").to_pylist()
    assert [row["run"] for row in rows] == [1, 2, 1, 2]
    assert {row["end"] for row in rows} == {"DONE"}
    for row, (run, signals) in zip(rows[2:], _runs(recordings[1]), strict=True):
        poses = poses_of(signals)
        assert row["run"] == run
        within = (poses.time_ns >= row["started_ns"]) & (poses.time_ns <= row["ended_ns"])
        assert row["x_m"] == poses.pose[within, 0].tolist()
        assert [row["started_ns"] + round(1e9 * at_s) for at_s in row["path_s"]] == poses.time_ns[within].tolist()
        assert len(row["tilt_s"]) == len(row["tilt_rad"]) > 100
        assert row["phases"][0] == "LEVEL"
        assert row["phase_s"][0] == 0.0


def _runs(path: Path) -> Iterator[tuple[int, Any]]:
    return ((run, signals) for run, signals in run_signals(open_recording(path)) if run)


def test_the_recordings_are_there_byte_for_byte_with_their_sums(dataset: Path, recordings: tuple[Path, Path]) -> None:
    origin = json.loads((dataset / "provenance.json").read_text("utf-8"))
    for told, path in zip(origin, recordings, strict=True):
        assert (dataset / told["file"]).read_bytes() == path.read_bytes()
        assert told["digest"] == digest(open_recording(path))
        assert told["versions"]["repose"]
        assert told["rig"] == "simulated"


def test_the_card_shows_figures_that_are_there_and_says_that_it_is_a_simulation(dataset: Path) -> None:
    card = (dataset / "README.md").read_text("utf-8")
    shown = [line.rpartition("(")[2].rstrip(")") for line in card.splitlines() if line.startswith("![")]
    assert any("limit_curve" in path for path in shown)
    assert all((dataset / path).is_file() and (dataset / path).with_suffix(".svg").is_file() for path in shown)
    assert "Static friction, simulated with Repose" in card
    assert "2 recordings, 4 samples" in card


def test_the_citation_has_what_its_format_demands(dataset: Path) -> None:
    told = YAML(typ="safe", pure=True).load((dataset / "CITATION.cff").read_text("utf-8"))
    assert {"cff-version", "message", "title", "authors"} <= told.keys()
    assert (told["type"], told["license"]) == ("dataset", "CC-BY-4.0")
    assert told["authors"] == [{"family-names": "Doe", "given-names": "Jo"}, {"name": "Example Lab"}]
    assert all(reference["authors"] for reference in told["references"])


@pytest.mark.parametrize(
    ("leave_out", "said"), [("--license", "SPDX"), ("--author", "cannot be cited")], ids=["licence", "author"]
)
def test_what_only_the_owner_knows_has_no_default(
    leave_out: str, said: str, recordings: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [
        text
        for option, text in zip(ASKED[::2], ASKED[1::2], strict=True)
        if option != leave_out
        for text in (option, text)
    ]
    assert main(["publish", str(recordings[0]), "--out", str(tmp_path / "out"), *words]) == 2
    assert said in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_folder_that_holds_something_is_left_alone(
    recordings: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "README.md").write_text("mine")
    assert main(["publish", str(recordings[0]), "--out", str(tmp_path), *ASKED]) == 2
    assert "exists; choose another one" in capsys.readouterr().err
    assert [path.read_text() for path in tmp_path.iterdir()] == ["mine"]


def test_a_recording_that_is_there_twice_is_refused_and_leaves_nothing(
    recordings: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = tmp_path / "copy.mcap"
    copy.write_bytes(recordings[0].read_bytes())
    assert main(["publish", str(recordings[0]), str(copy), "--out", str(tmp_path / "out"), *ASKED]) == 2
    assert "Expected every recording once" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [copy]


def test_a_table_is_no_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["publish", "samples.csv", "--out", str(tmp_path / "out"), *ASKED]) == 2
    assert "Expected recordings (.mcap)" in capsys.readouterr().err
