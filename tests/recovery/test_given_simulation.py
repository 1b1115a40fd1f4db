"""The given simulation is the baseline: the answer is about its difference from the recording, in all six ways.

A simulator that is called stands in this file, too: its recording is one that is diagnosed here anyway, in 8 s.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from shared.errors import UserError
from station.app import simulated_again
from station.diagnosis import given
from station.diagnosis.diagnose import Examined, evidence_from, examined
from station.diagnosis.given import against_given
from station.diagnosis.inference.columns import Scores
from station.diagnosis.inference.fit import Fit
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.report.sentences import sentence
from station.diagnosis.report.summary import summary
from station.diagnosis.result import Diagnosis, Differs, Value
from station.diagnosis.result_json import as_json
from station.diagnosis.search.posterior import posteriors_of
from station.diagnosis.search.search import Stage, in_stages, looked_at, search
from station.diagnosis.simulation_comparison import Found, as_noisy_as, compared_with_simulation
from station.diagnosis.told_apart import told_apart
from station.physics.catalogue import Catalogue, catalogue
from station.physics.effect import Effect
from station.physics.model import Model, Term
from station.signals.session import Signals
from station.simulators.rerun import only_runs
from station.simulators.simulator import simulator
from tests.recovery import given_simulator
from tests.recovery.given_sessions import NEAR, SETTING, known, model, recording, session, simulated
from tests.unit.diagnosis.recorded import golden


@cache
def against(recorded: tuple[float, float], given: tuple[float, float]) -> Diagnosis:
    """The answer about a simulation without scatter and without noise."""
    return against_given(
        recording(*recorded), simulated(model(*given)), known(), setting=SETTING, name="sim.mcap"
    ).diagnosis


@dataclass(frozen=True)
class Case:
    """Level and drop of both, and what must be said: whether the level differs, and who has the drop."""

    recorded: tuple[float, float]
    given: tuple[float, float]
    level: bool
    side: str | None


CASES = {
    "the level alone": Case((0.35, 0.0), (0.25, 0.0), level=True, side=None),
    "an effect is left out": Case((0.35, 0.2), (0.35, 0.0), level=False, side="recording"),
    "an effect is left out, and the level": Case((0.35, 0.2), (0.25, 0.0), level=True, side="recording"),
    "the effect is contained": Case((0.35, 0.2), (0.35, 0.2), level=False, side=None),
    "half of the effect is contained": Case((0.35, 0.2), (0.35, 0.1), level=False, side="both"),
    "only the simulation has it": Case((0.35, 0.0), (0.35, 0.2), level=False, side="simulation"),
}


@pytest.mark.parametrize("name", CASES)
def test_the_answer_is_about_the_difference(name: str) -> None:
    case = CASES[name]
    answer = against(case.recorded, case.given)
    claimed = [effect for effect in answer.effects if effect.verdict in ("supported", "indistinguishable")]
    assert {effect.side for effect in claimed} == ({case.side} if case.side else set()), sentence(answer)
    assert all(set(effect.class_ids) & NEAR for effect in claimed), sentence(answer)
    differs = {one.name.split(".")[0]: one for one in answer.differs}
    assert ("mu_s" in differs) == case.level, answer.differs
    if case.level:
        assert differs["mu_s"].simulation.value == pytest.approx(case.given[0], rel=0.03)
        recorded = differs["mu_s"].recording
        assert abs(recorded.value - case.recorded[0]) < 3 * recorded.sd + 0.02 * recorded.value
    if case.side == "both":
        ratio = next(one for id_, one in differs.items() if id_ in NEAR)
        assert ratio.simulation.value == pytest.approx(0.5 * ratio.recording.value, rel=0.35)
    if case.side is None:
        assert answer.verdict == "not supported"
        assert sentence(answer).startswith("Nothing is left out of the simulation")


@pytest.mark.parametrize(
    ("name", "percent"),
    [
        ("an effect is left out", -20),
        ("an effect is left out, and the level", -20),
        ("half of the effect is contained", -11),
    ],
)
def test_where_says_by_how_much_the_two_differ_there(name: str, percent: float) -> None:
    """A reading or the level once took up the difference, and its rest looked like changes with place and order."""
    case = CASES[name]
    places = against(case.recorded, case.given).located
    (everywhere,) = (place for place in places if place.covariate == "all" and place.phase == "slide")
    assert everywhere.p < 1e-4
    said = re.search(r"off by (-[0-9.]+) % throughout", everywhere.summary)
    assert said is not None
    assert float(said[1]) == pytest.approx(percent, abs=1.5)
    assert [place.summary for place in places if place.tested == "friction"] == []


def test_what_a_simulations_solver_does_is_no_physics() -> None:
    """A simulation that was made elsewhere creeps: its block at rest moves by some tenths of a millimetre."""
    creeping = model(0.35, 0.0).with_term(Term(known()["solver_creep"], {"time_s": 5e-5}))
    answer = against_given(
        recording(0.35, 0.0), simulated(creeping), known(), setting=SETTING, name="sim.mcap"
    ).diagnosis
    (creep,) = answer.numerics
    assert creep["id"] == "solver_creep"
    assert creep["size"] == pytest.approx(5e-5, rel=0.2)
    assert "stiffer contact" in creep["cured_by"]
    assert not [effect for effect in answer.effects if effect.side != "recording"], sentence(answer)
    assert sentence(answer) == "Nothing is left out of the simulation, but its solver has artefacts (solver_creep)."


@pytest.mark.parametrize("camera", [True, False])
def test_a_simulation_that_gives_paths_has_no_camera(camera: bool) -> None:
    """MuJoCo's soft contact lets a block give way a little, and every scene was told of a camera that sags."""
    sag = catalogue()["camera_sag"]
    sagging = simulated(model(0.35, 0.2).with_term(Term(sag, {**sag.neutral(), "shift_m": 2e-4})))
    few = {**FEW, sag.id: sag}
    answer = against_given(dropping(), sagging, few, setting=SETTING, name="scene.xml", camera=camera).diagnosis
    assert (sag.id in {effect.id for effect in answer.effects}) == camera


@pytest.mark.parametrize("camera", [True, False])
def test_a_path_has_no_clock_and_one_that_is_late_is_its_solvers(camera: bool) -> None:
    """A function that took gravity at each step's begin was told of an offset between its clocks."""
    clock = catalogue()["clock_offset"]
    late = simulated(model(0.35, 0.0).with_term(Term(clock, {"delay_s": 0.02, "of_arm": 0.0})))
    few = {**FEW, clock.id: clock}
    answer = against_given(dropping(), late, few, setting=SETTING, name="my_sim.py", camera=camera).diagnosis
    alone = {effect.id for effect in answer.effects if effect.side == "simulation"}
    assert (clock.id in alone) == camera
    assert [(one["id"], round(one["size"], 3)) for one in answer.numerics] == ([] if camera else [(clock.id, 0.02)])


def test_the_keys_of_the_difference_are_added_to_the_contract() -> None:
    answer = as_json(against((0.35, 0.2), (0.25, 0.0)))
    (level,) = answer["baseline"]["differs"]
    assert level["name"] == "mu_s"
    assert set(level) == {"name", "recording", "simulation", "unit"}
    assert set(level["recording"]) == {"value", "sd"}
    assert {effect["side"] for effect in answer["effects"]} == {"recording"}
    assert answer["baseline"]["simulator"] == "sim.mcap"


def test_without_a_simulation_the_recordings_own_answer_stands() -> None:
    answer = as_json(recording(0.35, 0.2).diagnosis)
    assert answer["baseline"]["differs"] == []
    assert answer["effects"][0]["side"] == "recording"


def test_what_remains_is_tested_with_all_that_the_recording_can_show(monkeypatch: pytest.MonkeyPatch) -> None:
    """A simulation that tells of onsets alone cannot show what a slide does, and the recording can."""
    asked = list[set[str]]()

    def noted(evidence: Evidence, current: Fit, offered: Sequence[Effect], **rest: Any) -> tuple[Stage, Scores]:
        asked.append({effect.id for effect in offered})
        return looked_at(evidence, current, offered, **rest)

    monkeypatch.setattr(given, "looked_at", noted)
    onsets = replace(simulated(model(0.25, 0.0)), geometry=None)
    answer = against_given(recording(0.35, 0.2), onsets, known(), setting=SETTING, name="onsets.mcap").diagnosis
    assert {"viscous", "rate_strengthening"} <= asked[-1]
    assert any(one.name == "mu_s" for one in answer.differs)
    assert answer.fit.before.onset_median_deg > 2.0 > answer.fit.after.onset_median_deg


FEW = {name: effect for name, effect in known().items() if name in ("kinetic_drop", "viscous")}


@cache
def dropping() -> Examined:
    """A session whose friction falls, looked at for two effects alone: the search is not what is tested here."""
    return examined(session(0.35, 0.2), FEW, setting=SETTING)


@cache
def hardly() -> Signals:
    """A simulation without the drop of which only the onsets are seen."""
    return replace(simulated(model(0.35, 0.0)), geometry=None)


def test_of_what_could_not_show_in_the_simulation_nothing_is_said() -> None:
    """Its onsets alone say nothing of a slide: that it has the drop, or lacks it, would be a guess."""
    answer = against_given(dropping(), hardly(), FEW, setting=SETTING, name="onsets.mcap").diagnosis
    assert [(effect.id, effect.verdict) for effect in answer.effects] == [("kinetic_drop", "untestable")]
    assert answer.verdict == "not supported"
    assert "cannot be said" in sentence(answer)
    assert math.isnan(answer.fit.before.path_median_mm)
    assert "path error" not in told(answer)


def told(answer: Diagnosis) -> str:
    console = Console(width=200, record=True, file=io.StringIO())
    console.print(summary(answer))
    return console.export_text()


def test_a_simulation_whose_slides_are_not_seen_is_asked_again_with_less_friction() -> None:
    """It slips with the recorded mean: where the recorded runs end, its blocks have hardly moved."""
    asked = list[float]()

    def again(friction: float) -> Signals:
        asked.append(friction)
        return simulated(model(0.35 * friction, 0.0))

    given = against_given(dropping(), hardly(), FEW, setting=SETTING, name="my_sim.py", again=again)
    assert 0.7 < asked[0] < 0.95  # once, by some standard deviations of the runs' scatter
    assert len(asked) == 1
    claimed = [(effect.id, effect.side) for effect in given.diagnosis.effects if effect.verdict == "supported"]
    assert claimed == [("kinetic_drop", "recording")]
    assert given.mu_s == pytest.approx(0.35, rel=0.01)
    assert not [one for one in given.diagnosis.differs if one.name == "mu_s"]


def test_of_a_simulation_whose_blocks_all_hold_only_a_lower_limit_is_said() -> None:
    holds = simulated(model(1.4, 0.0))
    with pytest.raises(
        UserError, match=r"in sim\.mcap the block held in each of 42 runs: its mu_s is at least"
    ) as told_of:
        against_given(dropping(), holds, FEW, setting=SETTING, name="sim.mcap")
    (least,) = re.findall(r"at least ([0-9.]+),", str(told_of.value))
    assert 0.35 < float(least) < 1.4
    with pytest.raises(
        UserError, match=r"my_sim\.py gave None for each of 42 runs: .* look whether it returns its path"
    ):
        against_given(dropping(), holds, FEW, setting=SETTING, name="my_sim.py", gave="gave None for")


def test_a_simulator_whose_blocks_all_hold_is_asked_with_less_friction_until_they_slide() -> None:
    asked = list[float]()

    def again(friction: float) -> Signals:
        asked.append(friction)
        return simulated(model(1.4 * friction, 0.0))

    given = against_given(dropping(), simulated(model(1.4, 0.0)), FEW, setting=SETTING, name="my_sim.py", again=again)
    assert len(asked) > 1
    assert given.mu_s == pytest.approx(1.4, rel=0.02)
    (level,) = [one for one in given.diagnosis.differs if one.name == "mu_s"]
    assert level.simulation.value == pytest.approx(1.4, rel=0.02)


def test_runs_that_a_simulation_lacks_are_counted() -> None:
    whole = simulated(model(0.35, 0.2))
    part, fewer = only_runs(whole, range(1, 26)), only_runs(whole, range(1, 10))
    assert part is not None
    assert fewer is not None
    answer = against_given(dropping(), part, FEW, setting=SETTING, name="part.mcap").diagnosis
    assert "part.mcap lacks 17 of the recording's 42 runs, which are compared with nothing" in answer.notes
    with pytest.raises(UserError, match=r"got 9 in part\.mcap: it lacks 33 of the recording's 42 runs$"):
        against_given(dropping(), fewer, FEW, setting=SETTING, name="part.mcap")


def found_by(known: Catalogue, signals: Signals) -> Found:
    """Everything that a search of a simulation finds, among these effects and all smooth terms."""
    mine = dropping().found
    assert mine is not None
    evidence = as_noisy_as(mine, evidence_from(signals, SETTING))
    rng = np.random.default_rng(1)
    start = Model(mu_s=dropping().diagnosis.mu_s.value)
    result = search(in_stages(evidence, tuple(known.values()), start=start, rng=rng, progress=print), rng, print)
    return Found(evidence=evidence, search=result, posteriors=posteriors_of(result))


def test_an_effect_that_the_simulation_shows_by_another_name_is_in_both() -> None:
    """Half of a drop may be found as a smooth term, whose class has the drop in it."""
    mine, theirs = dropping().found, found_by({}, simulated(model(0.35, 0.1)))
    assert mine is not None
    classes = {one.id: ("other", "kinetic_drop") for one in theirs.search.found}
    assert classes
    assert "kinetic_drop" not in classes
    theirs = replace(theirs, posteriors=replace(theirs.posteriors, classes=classes))
    (drop,) = compared_with_simulation(mine, theirs).effects
    assert (drop.effect and drop.effect.id, drop.side) == ("kinetic_drop", "both")
    (number,) = drop.reported
    assert number.simulation.value == pytest.approx(0.1, abs=0.02)
    assert number.recording.value == pytest.approx(0.2, abs=0.03)


def test_only_numbers_that_are_told_apart_are_said() -> None:
    clear, alike, bound = number("drop", 0.20, 0.10), number("creep", 0.05, 0.05), number("shape", 1.0, 0.0, held=True)
    assert told_apart([alike, clear, bound], [], price=3.0) == (clear,)
    assert told_apart([alike, number("drop", 0.12, 0.10), bound], [clear], price=3.0) == (clear,)


def number(name: str, here: float, there: float, *, held: bool = False) -> Differs:
    mine, theirs = (Value(value=value, sd=0.02, unit="1", at_bound=held) for value in (here, there))
    return Differs(name=name, recording=mine, simulation=theirs)


def test_a_simulation_with_too_little_in_it_is_one_sentence() -> None:
    recorded, rig = golden()
    few = simulator("planar").repeat(recorded, model(0.35, 0.0), rig=rig)
    with pytest.raises(UserError, match=r"at least 20 runs that can be compared, got 3 in sim\.mcap"):
        against_given(recording(0.35, 0.0), few, known(), setting=SETTING, name="sim.mcap")


@pytest.mark.parametrize("name", given_simulator.cases())
def test_a_simulator_that_is_called_gets_better_by_the_difference(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(simulated_again, "RUNS", 15)  # each is simulated eight times
    given_simulator.demand(given_simulator.CASES[name], tmp_path)
