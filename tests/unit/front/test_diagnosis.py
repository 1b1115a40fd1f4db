"""`station.diagnose`: the answer of the command, as an object that shows itself."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import station
from station.__main__ import main
from station.recording.tables import write_samples
from tests.readmes.reader import write_twenty_runs
from tests.unit.diagnosis.asked_once import ask_once
from tests.unit.diagnosis.page import Page
from tests.unit.diagnosis.recorded import GOLDEN
from tests.unit.diagnosis.tables import samples


@pytest.fixture(autouse=True)
def _each_question_is_answered_once(monkeypatch: pytest.MonkeyPatch) -> None:
    ask_once(monkeypatch)


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A table in which friction depends on the direction."""
    path = tmp_path_factory.mktemp("table") / "samples.csv"
    write_samples(samples(grain=0.2), path)
    return path


@pytest.fixture
def found(table: Path) -> station.Diagnosed:
    """A finding, told to be of a seed that no page shows by chance."""
    return replace(station.diagnose(table), seed=7)


def by_command(capsys: pytest.CaptureFixture[str], *words: str | Path) -> dict[str, Any]:
    """Returns what `station diagnose --json` prints."""
    assert main(["diagnose", *map(str, words), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def without_time(answer: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in answer.items() if name != "seconds"}


def test_a_table_gets_the_answer_of_the_command(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    answer = station.diagnose(table)
    assert without_time(answer.to_dict()) == without_time(by_command(capsys, table))
    assert answer.verdict == "indistinguishable"


def test_another_seed_gets_another_answer_that_is_the_commands(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A table without a finding has a p that depends on the draws, and takes a tenth of the time."""
    table = tmp_path / "plain.csv"
    write_samples(samples(runs=20), table)
    answer = station.diagnose(table, seed=5)
    assert without_time(answer.to_dict()) == without_time(by_command(capsys, table, "--seed", "5"))
    assert answer.to_dict()["global_p"] != station.diagnose(table).to_dict()["global_p"]


def test_a_recording_gets_the_answer_of_the_command_by_its_path_and_open(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "twenty.mcap"
    write_twenty_runs(path)
    told = by_command(capsys, path)
    for recording in (path, str(path), station.open(path)):
        answer = station.diagnose(recording)
        assert without_time(answer.to_dict()) == without_time(told)
        assert answer.to_dict()["seconds"] > 0


def test_a_simulation_is_a_recording_its_path_or_a_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, simulated = tmp_path / "twenty.mcap", tmp_path / "again.mcap"
    write_twenty_runs(path)
    station.simulate(path, {"friction": {"mu_s": 0.3}}).write(simulated)
    told = by_command(capsys, path, "--simulate", simulated)
    assert "mu_s" in [one["name"] for one in told["baseline"]["differs"]]
    for simulation in (str(simulated), station.open(simulated)):
        assert without_time(station.diagnose(path, simulation=simulation).to_dict()) == without_time(told)
    named = station.diagnose(path, simulation="planar").to_dict()
    assert named["fit"]["simulator_rerun"]["engine"] == "planar"


def test_it_prints_as_the_command_does(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_samples(samples(runs=3), tmp_path / "few.csv")
    assert main(["diagnose", str(tmp_path / "few.csv")]) == 0
    said, answer = capsys.readouterr().out, station.diagnose(tmp_path / "few.csv")
    assert str(answer).split() == said.split()
    assert answer.sentence.startswith("Nothing can be tested with this recording: expected at least 20 runs")


def test_a_notebook_shows_the_answer_with_figures_that_fetch_and_run_nothing(found: station.Diagnosed) -> None:
    text = found._repr_html_()  # pyright: ignore[reportPrivateUsage]
    page = Page(text)
    assert found.sentence in page.text
    assert page.figures >= 5
    assert "<script" not in text
    assert [place for place in page.fetched if not place.startswith("data:")] == []
    assert len(page.ids) == len(set(page.ids))
    assert {place[1:] for place in page.references} <= set(page.ids)


def test_a_notebook_shows_why_nothing_can_be_tested() -> None:
    page = Page(station.diagnose(GOLDEN)._repr_html_())  # pyright: ignore[reportPrivateUsage]
    assert "expected at least 20 runs" in page.text
    assert page.figures == 0


def test_report_and_model_are_written(found: station.Diagnosed, tmp_path: Path) -> None:
    found.write_report(tmp_path / "page.html")
    found.write_model(str(tmp_path / "model.toml"))
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == found.to_html()
    assert "seed 7" in Page(found.to_html()).text
    assert tomllib.loads((tmp_path / "model.toml").read_text(encoding="utf-8")) == found.model
    with pytest.raises(station.UserError, match="Expected to write the model to"):
        found.write_model(tmp_path / "no folder" / "model.toml")


def test_a_table_has_nothing_to_simulate_and_an_unknown_simulator_is_named(tmp_path: Path) -> None:
    write_samples(samples(), tmp_path / "samples.csv")
    with pytest.raises(station.UserError, match="Expected a simulated table"):
        station.diagnose(tmp_path / "samples.csv", simulation="planar")
    with pytest.raises(station.UserError, match=r"Expected mujoco, planar, .* got bullet"):
        station.diagnose(GOLDEN, simulation="bullet")
