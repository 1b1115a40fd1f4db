"""`station plan`: why, how many runs, and a plan that a session takes as it is; one source with `station diagnose`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
import tomli_w

from station.__main__ import main
from station.app.diagnosing import diagnose_file
from station.app.planned import RecordedPlan, upon, write_plan
from station.app.recordings import plan_toml
from station.diagnosis.diagnose import Examined
from station.diagnosis.next_experiment.changes import SINGLE, Change
from station.diagnosis.result import NextExperiment
from station.recording.writer import Recording
from station.sampling.plan import Plan, TiltPlan, load_plan
from tests.unit.diagnosis.tables import grained
from tests.unit.recording import session

CHANGED = NextExperiment(
    separates=(("contact_aging", "wear"),), runs=40, why="dwell at random tells contact_aging from wear",
    plan="# dwell at random\nsamples = 40\n\n[dwell]\nmin_s = 0.5\nmax_s = 30.0\n", changed=("dwell",),
)  # fmt: skip


def test_the_plan_is_one_that_a_session_takes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "plan.toml"
    assert main(["plan", "--separate", "viscous", "--out", str(out)]) == 0
    plan = load_plan(out)
    said = capsys.readouterr().out
    assert f"{plan.samples} runs: " in said
    assert "shows viscous" in said


@pytest.mark.parametrize("change", SINGLE, ids=lambda change: change.name)
def test_every_change_is_a_plan_or_is_done_by_hand(change: Change, tmp_path: Path) -> None:
    path = tmp_path / "plan.toml"
    path.write_text(tomli_w.dumps(dict(change.tables)))
    assert load_plan(path) != Plan() or change.by_hand


def test_a_recordings_next_experiment_is_that_of_its_diagnosis(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = SimpleNamespace(diagnosis=SimpleNamespace(next_experiment=CHANGED))

    def diagnosed(_path: Path, **_: object) -> SimpleNamespace:
        return found

    monkeypatch.setattr("station.app.commands.plan.diagnose_file", diagnosed)
    out = tmp_path / "plan.toml"
    assert main(["plan", str(tmp_path / "session.mcap"), "--out", str(out)]) == 0
    assert f"40 runs: {CHANGED.why}" in capsys.readouterr().out
    assert out.read_text() == CHANGED.plan


def test_what_a_plan_leaves_open_stays_as_recorded(tmp_path: Path) -> None:
    recorded = plan_toml(Plan(samples=7, tilt=TiltPlan(rate_deg_s=8.0, hold_s=0.5)))
    path = tmp_path / "plan.toml"
    write_plan(upon(RecordedPlan(recorded), CHANGED), path)
    plan = load_plan(path)
    assert (plan.samples, plan.tilt.rate_deg_s, plan.tilt.hold_s, plan.dwell.max_s) == (40, 8.0, 0.5, 30.0)
    assert path.read_text().startswith("# dwell at random\n")


def test_what_was_made_in_simulated_time_goes_on_in_it(tmp_path: Path) -> None:
    """A live session needs agents, which nobody who has only simulated has started."""
    path, simulated = tmp_path / "plan.toml", replace(CHANGED, lockstep=True)
    assert write_plan(CHANGED, path).endswith(f"station run --plan {path}")
    assert write_plan(simulated, path).endswith(f"station run --lockstep --plan {path}")


@pytest.mark.parametrize("mode", ["live", "lockstep", "import"])
def test_the_recording_says_if_it_was_made_in_simulated_time(
    mode: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = grained()

    def searched(*_: object, **__: object) -> Examined:
        return found

    def recommended(*_: object) -> Examined:
        return replace(found, diagnosis=replace(found.diagnosis, next_experiment=CHANGED))

    monkeypatch.setattr("station.app.diagnosing.examined", searched)
    monkeypatch.setattr("station.app.diagnosing.recommended", recommended)
    path = tmp_path / "session.mcap"
    Recording(path, provenance=session.provenance(mode=mode)).close()
    plan = diagnose_file(path).diagnosis.next_experiment
    assert plan is not None
    assert plan.lockstep == (mode == "lockstep")


def test_a_recorded_plan_has_no_list_that_is_empty() -> None:
    """An older recording's plan, which had no rates, is the same text."""
    assert "rates_deg_s" not in plan_toml(Plan())
    assert "rates_deg_s = [2.0, 12.0]" in plan_toml(Plan(tilt=TiltPlan(rates_deg_s=(2.0, 12.0))))


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--separate", "weer"], "did you mean wear"),
        (["--separate", "a,b"], "got 'a'; `station effects` lists them\n"),
        (["--separate", " , "], "got none"),
        (["--separate", "solver_creep"], "simulator's own"),
        (["--separate", "wear", "--mu", "-1"], "friction coefficient between 0 and 5"),
        (["--separate", "wear", "--rig", "none.toml"], "none.toml"),
        ([], "got both or neither"),
        (["session.mcap", "--separate", "wear"], "got both or neither"),
    ],
)
def test_mistakes_get_a_sentence(words: list[str], expected: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", *words]) == 2
    said = capsys.readouterr().err
    assert expected in said
    assert said.count("\n") == 1


@pytest.mark.parametrize("plan", [None, NextExperiment(separates=(), plan="", runs=0, why="no plan alone")])
def test_no_plan_is_not_written(plan: NextExperiment | None, tmp_path: Path) -> None:
    assert "No plan was written" in write_plan(plan, tmp_path / "plan.toml")
    assert not (tmp_path / "plan.toml").exists()
