"""`station plan --separate`: why, how many runs, and a plan that a session takes as it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from station.__main__ import main
from station.diagnosis.next_experiment.plan import DESIGNS, separate
from station.physics.catalogue import catalogue
from station.sampling.plan import load_plan


def test_the_plan_is_one_that_a_session_takes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "plan.toml"
    assert main(["plan", "--separate", "contact_aging,wear", "--out", str(out)]) == 0
    plan = load_plan(out)
    said = capsys.readouterr().out
    assert f"{plan.samples} runs: " in said
    assert "separates contact_aging from wear" in said
    assert plan.dwell.max_s > 10 * plan.dwell.min_s  # only dwell tells ageing from wear


@pytest.mark.parametrize("design", DESIGNS, ids=lambda design: design.name)
def test_every_design_is_a_plan(design: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("station.diagnosis.next_experiment.plan.DESIGNS", (design,))
    path = tmp_path / "plan.toml"
    path.write_text(separate([catalogue()["plate_anisotropy"]]).plan)
    assert load_plan(path).samples >= 20


def test_one_effect_is_to_be_confirmed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "--separate", "wear"]) == 0
    said = capsys.readouterr().out
    assert "to see wear" in said
    assert "samples = " in said


def test_what_no_plan_separates_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "--separate", "camera_sag,presliding"]) == 0
    assert "no plan alone separates them" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--separate", "weer"], "did you mean wear"),
        (["--separate", " , "], "got none"),
        (["--separate", "solver_creep"], "simulator's own"),
        (["--separate", "wear", "--mu", "-1"], "friction coefficient between 0 and 5"),
        (["--separate", "wear", "--out", "/proc/plan.toml"], "Expected to write the plan"),
        (["--separate", "wear", "--rig", "none.toml"], "none.toml"),
    ],
)
def test_mistakes_get_a_sentence(words: list[str], expected: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", *words]) == 2
    said = capsys.readouterr().err
    assert expected in said
    assert said.count("\n") == 1
