"""A block that tips is called so: by the independent generator's cases, by planted runs, and never by bad pictures."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from station.diagnosis import diagnose as diagnosing
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.table import table_evidence
from station.diagnosis.observations.tips import Tips
from station.diagnosis.report.page import html_page
from station.diagnosis.report.summary import summary
from station.diagnosis.search.tipping import shows_tipping, tipped_over, tipping
from station.physics.catalogue import catalogue
from station.recording.arrays import load_signals
from station.recording.reader import open_recording
from station.signals.session import Signals
from tests.concealed.cases import Plan, write_case
from tests.concealed.tiers import plan_case
from tests.unit.diagnosis.tables import samples

PRIOR = 0.02
TIPPING = catalogue()["tipping"]


def case(tier: str, index: int, folder: Path, *, only: tuple[str, ...] = ()) -> tuple[Plan, Signals]:
    """A case of the independent generator, as it is recorded."""
    plan = plan_case(tier, index, seed=7, only=only)
    write_case(plan, folder)
    return plan, load_signals(open_recording(next(folder.rglob("session.mcap"))))


@pytest.fixture(scope="module")
def concealed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Plan, Evidence]:
    """Six of a hundred blocks tip before they slide: the generator's limit of what can be detected."""
    plan, signals = case("single", 1, tmp_path_factory.mktemp("tipping"), only=("tipping",))
    return plan, evidence_of(signals, Setting())


def test_the_runs_that_tipped_are_known_and_no_others(concealed: tuple[Plan, Evidence]) -> None:
    plan, evidence = concealed
    tips = evidence.tips
    assert sorted(evidence.run_number[tips.run[tips.tipped]].astype(int)) == sorted(plan.entry["tipped_runs"])
    assert len(tips) > 0.9 * plan.setting.design.runs
    assert np.all(tips.stood[tips.tipped] < tips.fallen[tips.tipped])


def test_a_concealed_block_that_tips_is_named_with_its_slenderness_and_place(concealed: tuple[Plan, Evidence]) -> None:
    plan, evidence = concealed
    found = tipped_over(evidence, TIPPING, prior=PRIOR)
    assert found is not None
    assert found.effect.probability > 0.99
    assert found.p < 1e-4
    told = found.effect.parameters["slenderness"]
    true = 1.0 / math.tan(plan.entry["effects"][0]["value"])
    assert abs(told.value - true) < 4.0 * told.sd
    assert told.sd < 0.1 * true
    assert list(found.place.runs) == sorted(plan.entry["tipped_runs"])
    assert all(window.from_ns < window.to_ns for window in found.place.windows)


def test_a_concealed_null_never_tips(tmp_path: Path) -> None:
    _, signals = case("null_nuisance", 1, tmp_path)
    evidence = evidence_of(signals, Setting())
    assert len(evidence.tips) > 10
    assert not evidence.tips.tipped.any()
    assert tipped_over(evidence, TIPPING, prior=PRIOR) is None
    assert shows_tipping(evidence, TIPPING)


def made_up(rng: np.random.Generator, *, runs: int, stands_to: float, mistakes: float) -> Tips:
    """Blocks with friction 0.4 ± 10 % that stand up to a steepness; some are called tipped by mistake."""
    limit = stands_to * (1.0 + rng.normal(0.0, 0.005, runs))
    slips = 0.4 * (1.0 + 0.1 * rng.normal(size=runs))
    tips = slips > limit
    stood, fallen = np.where(tips, 0.97 * limit, slips), np.where(tips, 1.02 * limit, np.nan)
    wrong, when = (rng.random(runs) < mistakes) & ~tips, rng.random(runs)
    stood, fallen = np.where(wrong, 0.97 * when * stood, stood), np.where(wrong, 1.02 * when * slips, fallen)
    number, none = np.arange(runs), np.zeros(runs, dtype=np.int64)
    return Tips(run=number, stood=stood, fallen=fallen, from_ns=none, to_ns=none)


@pytest.mark.parametrize(("slenderness", "mistakes"), [(2.3, 0.0), (2.5, 0.0), (2.3, 0.02)])
def test_the_slenderness_is_found_within_its_error(slenderness: float, mistakes: float) -> None:
    pulls: list[float] = []
    for seed in range(8):
        rng = np.random.default_rng([seed, 1])
        tips = made_up(rng, runs=150, stands_to=1.0 / slenderness, mistakes=mistakes)
        found = tipping(tips)
        assert found is not None
        assert found.probability(PRIOR) > 0.99
        pulls.append((found.slenderness - slenderness) / found.sd)
    assert np.max(np.abs(pulls)) < 4.0


def test_mistakes_alone_are_no_block_that_tips() -> None:
    """Of a hundred sessions with one or two glares taken for a fall in each, hardly any are called tipping."""
    probability, p = list[float](), list[float]()
    for seed in range(100):
        found = tipping(made_up(np.random.default_rng([seed, 2]), runs=150, stands_to=99.0, mistakes=0.01))
        probability.append(0.0 if found is None else found.probability(PRIOR))
        p.append(1.0 if found is None else found.p)
    assert np.mean(np.array(probability) > 0.5) < 0.03
    assert np.mean(np.array(p) < 0.05) < 0.05


def test_a_diagnosis_ranks_it_beside_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """A session without any other effect, in which some blocks turned over."""
    table = samples(runs=60)
    tips = made_up(np.random.default_rng(3), runs=60, stands_to=0.43, mistakes=0.0)
    evidence = replace(table_evidence(table, Setting()), tips=tips)

    def made(*_: object) -> Evidence:
        return evidence

    monkeypatch.setattr(diagnosing, "table_evidence", made)
    found = diagnosing.examined(table, catalogue())
    told = found.diagnosis
    assert told.verdict == "supported"
    assert told.effects[0].id == "tipping"
    assert told.global_p < 1e-3
    assert told.none_probability < 0.01
    assert "tipping" not in told.untestable
    assert told.model["effects"]["tipping"]["slenderness"] == pytest.approx(1 / 0.43, rel=0.05)
    assert "tips over" in told.located[0].summary
    assert summary(told)
    assert "tips over" in html_page(told, found.pictures)
