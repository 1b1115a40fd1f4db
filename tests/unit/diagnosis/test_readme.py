"""What station/diagnosis/README.md shows works, and the columns that it names exist."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import pytest

from shared.messages import Sample
from station.recording.tables import write_samples
from tests.unit.diagnosis.tables import samples

README = (Path(__file__).parents[3] / "station" / "diagnosis" / "README.md").read_text(encoding="utf-8")


def test_the_notebook_example_runs_as_it_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_samples(samples(grain=0.2), tmp_path / "samples.csv")
    (example,) = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
    exec(compile(example, "README.md", "exec"), {})
    out = capsys.readouterr().out
    assert "indistinguishable" in out
    assert "anisotropy cos2" in out
    assert (tmp_path / "report.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")


def test_every_column_that_it_names_is_one_of_a_sample() -> None:
    table = README.partition("## Tables")[2].partition("## In a notebook")[0]
    rows = [line.split("|")[1] for line in table.splitlines() if line.startswith("| ")][1:]
    named = {name.strip() for row in rows for name in row.split(",")}
    assert named <= {spec.name for spec in fields(Sample)}
    assert "onset_angle_rad" in named
