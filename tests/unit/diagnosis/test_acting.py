"""The phases and runs in which an effect of a fitted model acts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from station.diagnosis.inference.fit import Fit, fit
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.table import table_evidence
from station.diagnosis.report.sentences import acts
from station.diagnosis.result import Acting, Diagnosis, EffectFound
from station.diagnosis.search.acting import acting
from station.physics.catalogue import catalogue
from station.physics.contact import Array
from station.physics.model import Model, Term
from tests.unit.diagnosis.test_held_out import plain_fit
from tests.unit.diagnosis.test_measured_tables import RUNS, measured


def found(name: str, **values: float) -> tuple[Evidence, dict[str, Acting]]:
    """The phases in which an effect of this size acts, beside the plain model of a session."""
    evidence, plain = plain_fit()
    effect = catalogue()[name]
    fitted: Fit = replace(plain, model=plain.model.with_term(Term(effect, {**effect.neutral(), **values})))
    return evidence, {one.phase: one for one in acting(evidence, fitted, effect)}


def sizes(one: Acting) -> Array:
    return np.array(one.sizes)


def test_a_drag_acts_in_slides_alone() -> None:
    evidence, phases = found("viscous", drag_n_s_m=0.05)
    assert phases["onset"].most[1] < 1e-6
    assert phases["slide"].median > 1.0
    assert set(phases["slide"].runs) <= set(evidence.run_number.astype(int).tolist())


def test_a_fall_of_sliding_friction_is_the_same_in_all_runs() -> None:
    """It is the drop over the friction's scatter and the windows' noise together."""
    _, phases = found("kinetic_drop", drop=0.1)
    assert phases["onset"].most[1] < 1e-6
    assert sizes(phases["slide"]).min() > 0.3 * sizes(phases["slide"]).max() > 0


def test_a_change_of_all_friction_is_another_mu() -> None:
    """All blocks of this session have one mass; a turning plate presses them a little more or less."""
    _, phases = found("load_dependence", exponent=0.3)
    assert phases["onset"].most[1] < 1e-6
    assert phases["slide"].most[1] < 0.1


def test_a_spot_in_which_blocks_begin_acts_on_those_that_leave_it() -> None:
    """Another mu is as well the spot's friction, in which most onsets are."""
    evidence, phases = found("friction_patch", spot=0.3, length_m=0.01)
    channel = next(one for one in evidence.channels if one.name == "along")
    inside = np.hypot(channel.rows.covariates["x"], channel.rows.covariates["y"]) < 0.01
    staying = set(evidence.run_number[channel.rows.run[inside]].astype(int).tolist())
    slide = phases["slide"]
    apart = [size for run, size in zip(slide.runs, slide.sizes, strict=True) if run not in staying]
    within = [size for run, size in zip(slide.runs, slide.sizes, strict=True) if run in staying]
    assert np.median(apart) > 1.0
    assert np.median(within) < 0.1


def test_sliding_friction_alone_has_a_level_too() -> None:
    """Nobody saw these blocks at rest: a factor on all of their friction is another mu all the same."""
    friction = 0.3 * np.exp(np.random.default_rng(1).normal(0.0, 0.02, RUNS))
    columns = {"friction_coefficient": friction, "normal_load_n": np.full(RUNS, 2.0)}
    evidence = table_evidence(measured(columns | {"sliding_speed_m_s": np.full(RUNS, 0.01)}), Setting())
    effect = catalogue()["load_dependence"]
    model = Model(mu_s=0.3, terms=(Term(effect, {**effect.neutral(), "exponent": 0.3}),))
    (slide,) = acting(evidence, fit(evidence, model, ()), effect)
    assert slide.phase == "slide"
    assert slide.most[1] < 1e-6


def test_shaking_acts_by_the_scatter_of_the_onsets() -> None:
    """Its mean is hardly more than another mu: the size is the shaking's deviation over that of equal runs."""
    _, weak = found("arm_vibration", sd_m_s2=0.1, cos1=0.0, sin1=0.0, tone_hz=5.0)
    _, strong = found("arm_vibration", sd_m_s2=0.2, cos1=0.0, sin1=0.0, tone_hz=5.0)
    assert strong["onset"].median == pytest.approx(2.0 * weak["onset"].median, rel=0.05)
    assert weak["onset"].median > 0.05


def test_the_sentence_leaves_out_phases_in_which_nothing_shows() -> None:
    film = EffectFound(
        id="viscous",
        title="drag",
        class_ids=("viscous",),
        probability=1.0,
        verdict="supported",
        parameters={},
        acting=(
            Acting(phase="onset", runs=(1, 2), sizes=(0.0, 0.0)),
            Acting(phase="slide", runs=(1, 2, 7), sizes=(0.5, 3.11, 1.0)),
        ),
    )
    found = Diagnosis(recording="a", total_runs=7, used_runs=7, effects=(film,))
    assert acts(found) == ["viscous acts in: slide (1 times the spread between equal runs, 3.1 in run 2)"]
    rare = Acting(phase="slide", runs=(1, 2, 3), sizes=(0.0, 24.0, 0.0))
    said = acts(replace(found, effects=(replace(film, acting=(rare,)),)))
    assert said == [
        "viscous acts in: slide (in fewer than half of the runs; 24 times the spread between equal ones in run 2)"
    ]
    assert "between equal rows, 3.1 in row 2" in acts(replace(found, counted="rows"))[0]
    assert acts(replace(found, effects=(replace(film, acting=film.acting[:1]),))) == []
    assert acts(replace(found, effects=(replace(film, verdict="not supported"),))) == []
    theirs = replace(found, given=True, effects=(replace(film, side="simulation"),))
    assert acts(theirs)[0].startswith("viscous of the simulation acts in: slide")
