"""`station.simulate`: the session again, as a recording of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import station
from station.__main__ import main
from station.recording.for_viewers import TOPICS as FOR_VIEWERS
from station.recording.reader import digest, open_recording
from tests.unit.diagnosis.page import Page
from tests.unit.diagnosis.recorded import GOLDEN

MODEL: dict[str, Any] = {"friction": {"mu_s": 0.36, "scatter": 0.05}}
TOML = "[friction]\nmu_s = 0.36\nscatter = 0.05\n"


def test_it_writes_what_the_command_writes(tmp_path: Path) -> None:
    (tmp_path / "model.toml").write_text(TOML)
    by_command = tmp_path / "command.mcap"
    words = ["--model", str(tmp_path / "model.toml"), "--out", str(by_command), "--seed", "3"]
    assert main(["simulate", str(GOLDEN), *words]) == 0
    for number, model in enumerate((MODEL, tmp_path / "model.toml")):
        own = tmp_path / f"own{number}.mcap"
        count = station.simulate(GOLDEN, model, seed=3).write(own)
        topics = open_recording(own).topics
        assert count == sum(info.count for name, info in topics.items() if name not in FOR_VIEWERS)
        assert digest(open_recording(own)) == digest(open_recording(by_command))
        assert open_recording(own).metadata["session"] == open_recording(by_command).metadata["session"]


def test_its_tables_are_those_of_the_recording_that_it_writes(tmp_path: Path) -> None:
    simulated = station.simulate(station.open(GOLDEN), MODEL)
    simulated.write(tmp_path / "again.mcap")
    written = station.open(tmp_path / "again.mcap")
    for name in ("samples", "corners", "attitude", "events", "commands"):
        one, other = (getattr(each, name).to_numpy() for each in (simulated, written))
        assert one.keys() == other.keys()
        for column in one:
            assert np.array_equal(one[column], other[column], equal_nan=one[column].dtype.kind == "f"), column


def test_the_differences_are_simulated_less_recorded() -> None:
    recorded = station.open(GOLDEN)
    simulated = station.simulate(recorded, {"friction": {"mu_s": 0.36}})
    apart = np.degrees(simulated.samples["onset_angle_rad"] - recorded.samples["onset_angle_rad"])
    assert simulated.differences["onset_deg"] == pytest.approx(apart)
    assert simulated.differences.columns == ("run", "onset_deg", "path_mm", "turn_deg")
    assert "Onsets of 3 runs: mean difference" in repr(simulated)
    assert simulated.recorded is recorded


def test_it_says_what_scatter_does_to_the_comparison() -> None:
    simulated = station.simulate(GOLDEN, {"friction": {"mu_s": 0.36, "scatter": 0.06}})
    assert "Friction scatters by 6 % from run to run" in repr(simulated)
    assert max(map(len, repr(simulated).splitlines()[1:])) <= 120
    assert "Friction scatters by 6 %" in simulated._repr_html_()  # pyright: ignore[reportPrivateUsage]


def test_the_recording_stays_as_it_was() -> None:
    recorded = station.open(GOLDEN)
    before = {name: column.copy() for name, column in recorded.corners.to_numpy().items()}
    station.simulate(recorded, MODEL, seed=1)
    for name, column in recorded.corners.to_numpy().items():
        assert np.array_equal(column, before[name], equal_nan=column.dtype.kind == "f")


def test_a_notebook_shows_both_with_a_figure() -> None:
    text = station.simulate(GOLDEN, MODEL)._repr_html_()  # pyright: ignore[reportPrivateUsage]
    page = Page(text)
    assert page.figures == 1
    assert [place for place in page.fetched if not place.startswith("data:")] == []
    assert "<script" not in text
    assert f"planar simulation of {GOLDEN}" in page.text


@pytest.mark.parametrize(
    ("model", "simulator", "said"),
    [
        ({"friction": {}}, "planar", "Expected mu_s in the table"),
        ({"friction": {"mu_s": 0.3}, "effects": {"magic": {"size": 1.0}}}, "planar", "got magic"),
        ("none.toml", "planar", "none.toml"),
        (MODEL, "bullet", "Expected a simulator"),
        (3, "planar", "Expected the path of a model.toml or its tables, got int"),
    ],
)
def test_what_cannot_be_simulated_is_said(model: Any, simulator: str, said: str) -> None:
    with pytest.raises(station.UserError, match=said):
        station.simulate(GOLDEN, model, simulator=simulator)
