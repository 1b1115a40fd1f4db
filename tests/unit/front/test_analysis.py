"""`station.analyze`: the analysis of the command, as an object that shows itself."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import station
from station.__main__ import main
from station.app import analysis_files
from station.recording.tables import read_samples, write_samples
from tests.unit.diagnosis.page import Page
from tests.unit.diagnosis.recorded import GOLDEN
from tests.unit.friction.sessions import sample, session


@pytest.fixture
def table(tmp_path: Path) -> Path:
    """Forty slides, one of which a filter flags."""
    path = tmp_path / "samples.csv"
    write_samples([*session(40, rng=np.random.default_rng(1)), sample(run=901, slide_m=0.001)], path)
    return path


def test_it_says_and_writes_what_the_command_does(
    table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(analysis_files, "figure_kinds", tuple)  # figures are looked at elsewhere, and take seconds
    found, out = station.analyze(table), tmp_path / "out"
    status = main(["analyze", str(table), "--out", str(out)])
    assert status == int(found.has_findings)
    printed = capsys.readouterr().out
    for sentences in found.sentences.values():
        for sentence in sentences:
            assert sentence in " ".join(printed.split())
    assert json.loads((out / "limit_curves.json").read_text(encoding="utf-8")) == found.limit_curves
    own = tmp_path / "own"
    lines = found.write(own)
    assert f"Report: {own / 'report.html'}" in "\n".join(lines)
    for name in ("samples.csv", "limit_curves.json"):
        assert (own / name).read_bytes() == (out / name).read_bytes()
    page, same = ((one / "report.html").read_text(encoding="utf-8") for one in (own, out))
    assert f"station analyze {table} --out {own}</code>" in page
    assert page.replace(str(own), str(out)) == same


def test_its_samples_carry_the_filters_names(table: Path) -> None:
    found = station.analyze(str(table)).samples
    recorded = station.open(GOLDEN).samples.columns
    assert found.columns == tuple(name for name in recorded if name != "foam_free_m"), "which a table may lack"
    assert dict(zip(found["run"].tolist(), found["flags"].tolist(), strict=True))[901] == "distance"
    assert len(found) == len(read_samples(table))


def test_open_recordings_and_paths_are_put_together(tmp_path: Path) -> None:
    other = [replace(one, object="steel cube", plate="steel") for one in session(30, rng=np.random.default_rng(2))]
    write_samples(other, tmp_path / "other.csv")
    found = station.analyze([station.open(GOLDEN), tmp_path / "other.csv"])
    assert list(found.sentences) == ["steel cube on steel"]
    assert len(found.samples) == 33
    assert [one.source for one in found.sessions] == [str(GOLDEN), str(tmp_path / "other.csv")]
    assert [one.geometry is None for one in found.sessions] == [False, True]
    lent = station.analyze(tmp_path / "other.csv", calibration=GOLDEN)
    assert lent.sessions[0].geometry is not None
    with pytest.raises(station.UserError, match="Expected every sample once, but 3 of"):
        station.analyze([station.open(GOLDEN), GOLDEN])


def test_a_simulated_session_is_analysed_as_a_recorded_one() -> None:
    simulated = station.simulate(GOLDEN, {"friction": {"mu_s": 0.36}})
    found = station.analyze(simulated)
    assert found.samples["onset_angle_rad"].tolist() == simulated.samples["onset_angle_rad"].tolist()


def test_a_notebook_shows_conclusions_figures_and_tables(table: Path) -> None:
    text = station.analyze(table)._repr_html_()  # pyright: ignore[reportPrivateUsage]
    page = Page(text)
    assert text.count("<img ") == 2
    assert page.fetched
    assert all(place.startswith("data:image/png;base64,") for place in page.fetched)
    assert "<script" not in text
    assert "Angle of repose" in page.text
    assert "Results by surface pair" in page.text


@pytest.mark.parametrize("cutout_m", [0.0, -0.01])
def test_an_opening_without_a_radius_is_refused(table: Path, cutout_m: float) -> None:
    with pytest.raises(station.UserError, match="Expected a positive radius"):
        station.analyze(table, cutout_m=cutout_m)


def test_a_calibration_that_is_none_is_said(table: Path, tmp_path: Path) -> None:
    with pytest.raises(station.UserError, match=r"none\.mcap"):
        station.analyze(table, calibration=tmp_path / "none.mcap")
