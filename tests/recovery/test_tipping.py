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
from station.diagnosis.search.toppled import Masses, acting_on_mass, masses, numbers_of, shows_toppling, toppled
from station.physics.catalogue import catalogue
from station.physics.effect import Effect
from station.recording.arrays import load_signals
from station.recording.reader import open_recording
from station.signals.session import Signals
from tests.concealed.cases import Plan, write_case
from tests.concealed.tiers import plan_case
from tests.contracts.effect_states import contacts
from tests.unit.diagnosis.tables import samples

PRIOR = 0.02
EVERY = tuple(catalogue().values())
TIPPING, OFFSET = catalogue()["tipping"], catalogue()["com_offset"]
BLOCK = contacts(1, area_m2=1e-4)


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
    assert np.all(tips.stood[tips.tipped].max(axis=1) < tips.fallen[tips.tipped].max(axis=1))


def test_a_concealed_block_that_tips_is_named_with_its_slenderness_and_place(concealed: tuple[Plan, Evidence]) -> None:
    plan, evidence = concealed
    found = toppled(evidence, EVERY, prior=PRIOR, rng=np.random.default_rng(5))
    assert found is not None
    (effect,) = found.effects
    assert effect.id == "tipping"
    assert effect.probability > 0.99
    assert found.p < 1e-4
    told = effect.parameters["slenderness"]
    true = 1.0 / math.tan(plan.entry["effects"][0]["value"])
    assert abs(told.value - true) < 4.0 * told.sd
    assert told.sd < 0.1 * true
    assert list(found.places[0].runs) == sorted(plan.entry["tipped_runs"])
    assert all(window.from_ns < window.to_ns for window in found.places[0].windows)


def test_a_concealed_null_never_tips(tmp_path: Path) -> None:
    _, signals = case("null_nuisance", 1, tmp_path)
    evidence = evidence_of(signals, Setting())
    assert len(evidence.tips) > 10
    assert not evidence.tips.tipped.any()
    assert toppled(evidence, EVERY, prior=PRIOR, rng=np.random.default_rng(5)) is None
    assert shows_toppling(evidence, TIPPING)
    assert not shows_toppling(evidence, OFFSET)


def test_a_concealed_mass_off_the_middle_is_named_with_its_place(tmp_path: Path) -> None:
    """The independent generator's block, its mass .8 mm off, topples over each edge at another tilt."""
    plan = plan_case("single", 1, seed=7, only=("tipping",))
    world = plan.setting.world
    world = world._replace(mass_x=6e-4, mass_y=-5e-4, tips_at=0.85 * world.tips_at)
    write_case(replace(plan, setting=replace(plan.setting, world=world)), tmp_path)
    evidence = evidence_of(load_signals(open_recording(next(tmp_path.rglob("session.mcap")))), Setting())
    found = toppled(evidence, EVERY, prior=PRIOR, rng=np.random.default_rng(6))
    assert found is not None
    told = {one.id: one for one in found.effects}
    assert told["com_offset"].probability > 0.9
    place = told["com_offset"].parameters
    assert abs(place["x_m"].value - 6e-4) < 4.0 * place["x_m"].sd
    assert abs(place["y_m"].value + 5e-4) < 4.0 * place["y_m"].sd
    assert place["x_m"].sd < 2e-4


def made_up(
    rng: np.random.Generator,
    *,
    runs: int,
    stands_to: float,
    mistakes: float,
    off: tuple[float, float] = (0.0, 0.0),
) -> Tips:
    """Blocks with friction 0.4 ± 10 % that stand up to a steepness; some are called tipped by mistake.

    Each leans towards one of its edges; `off` is the place of its mass in widths of the sole.
    """
    edge = rng.integers(0, 4, runs)
    nearer = np.array([off[0], off[1], -off[0], -off[1]])[edge]
    limit = stands_to * (1.0 - 2.0 * nearer) * (1.0 + rng.normal(0.0, 0.005, runs))
    slips = 0.4 * (1.0 + 0.1 * rng.normal(size=runs))
    tips = slips > limit
    stood, fallen = np.where(tips, 0.97 * limit, slips), np.where(tips, 1.02 * limit, np.nan)
    wrong, when = (rng.random(runs) < mistakes) & ~tips, rng.random(runs)
    stood, fallen = np.where(wrong, 0.97 * when * stood, stood), np.where(wrong, 1.02 * when * slips, fallen)
    number, none = np.arange(runs), np.zeros(runs, dtype=np.int64)
    lean = np.eye(4)[edge]
    fallen = np.where(np.isnan(fallen)[:, None], np.nan, lean * np.nan_to_num(fallen)[:, None])
    return Tips(run=number, stood=lean * stood[:, None], fallen=fallen, from_ns=none, to_ns=none)


def told_of(tips: Tips) -> Masses:
    """Returns what the runs say of the place of the mass."""
    found = masses(tips, EVERY, BLOCK, prior=PRIOR, rng=np.random.default_rng(5))
    assert found is not None
    return found


def pulls(found: Masses, acting: tuple[Effect, ...], true: tuple[float, ...]) -> list[float]:
    """Returns how far each number of a model is off, in its standard errors."""
    posterior = found.posteriors[acting]
    size = len(true)
    return np.abs((posterior.mean()[:size] - true) / posterior.sd()[:size]).tolist()


@pytest.mark.parametrize("seeds", [range(2), pytest.param(range(2, 8), marks=pytest.mark.benchmark)])
@pytest.mark.parametrize(("slenderness", "mistakes"), [(2.3, 0.0), (2.5, 0.0), (2.3, 0.02)])
def test_the_slenderness_is_found_within_its_error(slenderness: float, mistakes: float, seeds: range) -> None:
    for seed in seeds:
        rng = np.random.default_rng([seed, 1])
        found = told_of(made_up(rng, runs=150, stands_to=1.0 / slenderness, mistakes=mistakes))
        assert found.likeliest() == (TIPPING,)
        assert found.probability(TIPPING) > 0.99
        assert max(pulls(found, (TIPPING,), (slenderness,))) < 4.0


@pytest.mark.parametrize(("x", "y"), [(0.04, 0.0), (-0.05, 0.06)])
def test_a_mass_off_the_middle_is_found_by_the_edges_over_which_blocks_topple(x: float, y: float) -> None:
    """Half a millimetre of ten: each edge has a limit of its own."""
    for seed in range(4):
        tips = made_up(np.random.default_rng([seed, 4]), runs=150, stands_to=0.4, mistakes=0.0, off=(x, y))
        found = told_of(tips)
        acting = acting_on_mass(EVERY)
        assert found.probability(OFFSET) > 0.99
        assert found.probability(TIPPING) > 0.99
        named = dict(zip([one.name for one in numbers_of(acting)], found.posteriors[acting].mean(), strict=False))
        sd = dict(zip([one.name for one in numbers_of(acting)], found.posteriors[acting].sd(), strict=False))
        for name, true in (("x_m", 0.01 * x), ("y_m", 0.01 * y), ("slenderness", 2.5)):
            assert abs(named[name] - true) < 4.0 * sd[name]


@pytest.mark.parametrize("sessions", [20, pytest.param(100, marks=pytest.mark.benchmark)])
def test_mistakes_alone_are_no_block_that_tips(sessions: int) -> None:
    """Sessions with one or two glares taken for a fall in each are hardly ever called tipping: of twenty none."""
    probability, p = list[float](), list[float]()
    for seed in range(sessions):
        tips = made_up(np.random.default_rng([seed, 2]), runs=150, stands_to=99.0, mistakes=0.01)
        found = masses(tips, EVERY, BLOCK, prior=PRIOR, rng=np.random.default_rng(5))
        probability.append(0.0 if found is None else found.probability(TIPPING))
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
