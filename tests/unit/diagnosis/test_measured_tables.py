"""Tables of tribometers and of other rigs: their evidence, and what is said of them."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from rich.console import Console

from shared.messages import Sample
from station.diagnosis.diagnose import examined
from station.diagnosis.next_experiment.recommended import recommended
from station.diagnosis.observations.onsets import Onsets
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.table import table_evidence
from station.diagnosis.predict.folds import assigned
from station.diagnosis.report.page import html_page
from station.diagnosis.report.sentences import sentence
from station.diagnosis.report.summary import summary
from station.diagnosis.result import Diagnosis
from station.diagnosis.result_json import as_json
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term
from station.signals.measured import Measured
from tests.unit.diagnosis.tables import samples

Columns = Mapping[str, NDArray[Any]]
RUNS = 80
LOADS_N = np.geomspace(0.05, 1.0, RUNS)


def measured(columns: Columns, *, run: NDArray[np.int64] | None = None, group: tuple[str, ...] = ()) -> Measured:
    count = len(next(iter(columns.values())))
    numbers = np.zeros(count, dtype=np.int64) if run is None else run
    return Measured(samples=tuple(Sample(run=int(one)) for one in numbers), more=columns, group=group)


def under_loads(order: NDArray[np.int64], *, run: NDArray[np.int64] | None = None, seed: int = 1) -> Measured:
    """Friction that falls with the load to the power 0.3 and scatters by 3 %, under loads in an order of their own."""
    rng, load = np.random.default_rng(seed), LOADS_N[order]
    friction = 0.5 * load**-0.3 * np.exp(rng.normal(0.0, 0.03, RUNS))
    speed = np.full(RUNS, 0.01)
    return measured({"friction_coefficient": friction, "normal_load_n": load, "sliding_speed_m_s": speed}, run=run)


@cache
def raised() -> Diagnosis:
    """The load was raised from run to run."""
    found = examined(under_loads(np.arange(RUNS), run=np.arange(RUNS)), catalogue())
    return recommended(found, catalogue()).diagnosis


# --- the order of the rows --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [3, 5])
def test_a_table_sorted_by_its_angles_says_what_the_shuffled_one_says(seed: int) -> None:
    rows = [replace(one, run=0) for one in samples(grain=0.2, seed=seed)]
    ranked = sorted(rows, key=lambda one: one.onset_angle_rad)
    one, other = (examined(each, catalogue(), seed=1).diagnosis for each in (rows, ranked))
    assert one.global_p == other.global_p
    assert [(effect.id, effect.parameters) for effect in one.effects] == [
        (effect.id, effect.parameters) for effect in other.effects
    ]
    assert "order of the runs is unknown" in one.untestable["wear"]
    assert not [place for place in one.located if place.covariate == "run"]


def test_sorted_angles_of_nothing_are_met_with_silence() -> None:
    ranked = sorted((replace(one, run=0) for one in samples()), key=lambda one: one.onset_angle_rad)
    found = examined(ranked, catalogue()).diagnosis
    assert found.verdict == "not supported"
    assert any("nothing can be said of the order" in note for note in found.notes)


def test_times_alone_tell_the_order() -> None:
    time_s = np.random.default_rng(2).permutation(RUNS) * 60.0
    seen = table_evidence(measured({"friction_coefficient": np.full(RUNS, 0.4), "time_s": time_s}), Setting())
    contact = seen.contact()
    assert contact is not None
    assert contact.run.tolist() == list(range(RUNS))


# --- loads and speeds -------------------------------------------------------------------------------------------------


def test_a_tribometers_contact_has_its_load_and_its_speed() -> None:
    table = measured({"friction_force_n": np.array([0.2, 0.5]), "normal_load_n": np.array([1.0, 2.0])})
    (channel,) = table_evidence(table, Setting()).channels
    assert channel.name == "onset"
    assert channel.contact is not None
    assert (channel.contact.mass_kg * channel.contact.pressing_m_s2).tolist() == pytest.approx([1.0, 2.0])
    assert channel.residual(Model(mu_s=0.2)).tolist() == pytest.approx([0.0, math.log(0.25 / 0.2)])


def test_adhesion_and_drag_act_at_the_load_that_was_set() -> None:
    load, speed = np.array([1.0, 4.0]), np.array([0.1, 0.1])
    table = measured({"friction_coefficient": np.full(2, 0.4), "normal_load_n": load, "sliding_speed_m_s": speed})
    (channel,) = table_evidence(table, Setting()).channels
    known = catalogue()
    sticky = Model(mu_s=0.4, terms=(Term(known["adhesion"], {"force_n": 0.5}),))
    assert channel.residual(sticky).tolist() == pytest.approx((-np.log1p(0.5 / load)).tolist())
    viscous = Model(mu_s=0.4, terms=(Term(known["viscous"], {"drag_n_s_m": 1.0, "by_load": 0.0}),))
    assert channel.residual(viscous).tolist() == pytest.approx((-np.log1p(0.1 / (0.4 * load))).tolist())


def test_the_load_of_an_onset_is_that_of_its_tilt() -> None:
    table = replace(Measured.of(samples(runs=5)), more={"normal_load_n": np.full(5, 2.0)})
    (channel,) = table_evidence(table, Setting()).channels
    assert isinstance(channel, Onsets)
    at = channel.moments.reported
    assert at.mass_kg * at.pressing_m_s2 == pytest.approx(np.full(5, 2.0))


def test_a_load_that_was_raised_from_run_to_run_is_no_wear() -> None:
    (claimed,) = [one for one in raised().effects if one.verdict != "not supported"]
    assert {"wear", "load_dependence"} <= set(claimed.class_ids)
    plan = raised().next_experiment
    assert plan is not None
    assert "same loads in random order" in plan.why


def advised(table: Measured) -> str:
    plan = recommended(examined(table, catalogue()), catalogue()).diagnosis.next_experiment
    return "" if plan is None else plan.why


def test_an_unknown_order_is_to_be_known() -> None:
    """Without a column run or time a load that rose all the time looks like loads in random order."""
    why = advised(under_loads(np.arange(RUNS)))
    assert why.startswith("the same loads in random order, with a column run or time")
    assert why.endswith("load_dependence from wear")


def test_loads_that_were_dealt_are_not_to_be_dealt_again() -> None:
    why = advised(under_loads(np.random.default_rng(7).permutation(RUNS), run=np.arange(RUNS)))
    assert "random order" not in why
    assert "range of ten to one" not in why


def stepped(speed: NDArray[np.float64]) -> Measured:
    rng = np.random.default_rng(11)
    friction = 0.4 + 0.02 * np.log(speed / 1e-6) + rng.normal(0.0, 0.004, RUNS)
    return measured({"friction_coefficient": friction, "sliding_speed_m_s": speed}, run=np.arange(RUNS))


def test_a_speed_that_was_raised_once_comes_in_random_order_next() -> None:
    why = advised(stepped(np.repeat([1e-6, 1e-5], RUNS // 2)))
    assert (
        why
        == "the same sliding speeds in random order tells rate_strengthening from a change with the order of measuring"
    )
    assert "friction_patch" not in why


def test_speeds_that_were_dealt_are_to_reach_farther() -> None:
    speed = np.random.default_rng(4).permutation(np.repeat([1e-6, 1e-5], RUNS // 2))
    assert advised(stepped(speed)).startswith("sliding speeds over a wider range than 1e-06 to 1e-05 m/s")


def warming(seed: int, *, by: str) -> Measured:
    """The room warms while friction falls by a sixth: with the temperature, or as what wears settles."""
    rng, run = np.random.default_rng(seed), np.arange(RUNS)
    warm = 20.0 + 6.0 * run / RUNS + rng.normal(0.0, 0.05, RUNS)
    falls = 0.03 * (warm - 20.0) if by == "temperature" else 0.2 * -np.expm1(-run / 40)
    friction = 0.4 * (1.0 - falls) * np.exp(rng.normal(0.0, 0.03, RUNS))
    table = measured({"friction_coefficient": friction}, run=run)
    each = zip(table.samples, warm.tolist(), strict=True)
    return replace(table, samples=tuple(replace(one, temperature_c=t) for one, t in each))


@pytest.mark.parametrize("by", ["temperature", "run"])
@pytest.mark.parametrize("seed", [20261541, 20261542])
def test_a_temperature_that_rose_with_the_runs_is_never_wear_alone(by: str, seed: int) -> None:
    found = recommended(examined(warming(seed, by=by), catalogue()), catalogue()).diagnosis
    (claimed,) = [one for one in found.effects if one.verdict != "not supported"]
    assert set(claimed.class_ids) == {"wear", "other"}
    assert claimed.other_by == "temperature"
    said = sentence(found)
    assert said.startswith("The recording shows either ")
    assert "a change with the temperature" in said
    plan = found.next_experiment
    assert plan is not None
    assert plan.why.startswith("the same temperatures in random order, or the same again while the temperature holds")


def test_what_is_not_claimed_calls_for_no_experiment() -> None:
    rng = np.random.default_rng(6)
    columns = {"friction_coefficient": 0.4 * np.exp(rng.normal(0.0, 0.02, RUNS)), "normal_load_n": LOADS_N}
    assert not advised(measured(columns, run=rng.permutation(RUNS)))


def test_a_tables_rows_and_its_sliding_friction_are_called_so() -> None:
    table = under_loads(np.random.default_rng(7).permutation(RUNS), run=np.arange(RUNS))
    found = examined(table, catalogue())
    console = Console(file=io.StringIO(), width=200)
    console.print(summary(found.diagnosis))
    told = str(console.file.getvalue())  # type: ignore[attr-defined]
    assert f"{RUNS} of {RUNS} rows" in told
    assert "unseen rows" in told
    assert " runs" not in told
    page = html_page(found.diagnosis, found.pictures)
    assert "<td>mu_k</td>" in page
    assert "mu_s</td>" not in page
    answer = as_json(found.diagnosis)
    assert answer["baseline"]["parameters"]["mu_k"] == answer["baseline"]["parameters"]["mu_s"]
    assert answer["runs"]["counted"] == "rows"


def test_loads_in_random_order_have_their_exponent() -> None:
    order = np.random.default_rng(7).permutation(RUNS)
    found = examined(under_loads(order, run=np.arange(RUNS)), catalogue()).diagnosis
    assert found.effects[0].class_ids == ("load_dependence",)
    exponent = found.effects[0].parameters["exponent"]
    assert abs(exponent.value - 0.3) < 3 * exponent.sd + 0.02


def test_no_word_of_tilt_steps_and_no_number_that_is_none() -> None:
    found = examined(under_loads(np.arange(RUNS)), catalogue())
    told = " ".join([html_page(found.diagnosis, found.pictures), str(as_json(found.diagnosis))])
    assert "loads over a range of ten to one" in told
    assert not re.search(r"tilt step|tilt rate|station run|\bnan\b", told)


def test_a_slope_per_e_fold_has_its_error_wherever_it_is_told() -> None:
    """Only its slope is known of a law of the speed whose static friction was never seen."""
    rng, speed = np.random.default_rng(11), np.repeat(np.geomspace(1e-6, 1e-4, 4), RUNS // 4)
    friction = 0.4 + 0.02 * np.log(speed / 1e-6) + rng.normal(0.0, 0.004, RUNS)
    columns = {"friction_coefficient": friction, "sliding_speed_m_s": speed}
    found = examined(measured(columns, run=rng.permutation(RUNS)), catalogue())
    effect = next(one for one in found.diagnosis.effects if one.id == "rate_strengthening")
    (slope,) = effect.determined
    assert abs(slope.value - 0.02) < 3 * slope.sd < 0.003
    console = Console(width=400, record=True, file=io.StringIO())
    console.print(summary(found.diagnosis))
    assert f"as a coefficient: {slope.value:.5f} ± {slope.sd:.5f}" in console.export_text()
    (told,) = next(one for one in as_json(found.diagnosis)["effects"] if one["id"] == effect.id)["determined"]
    assert told["sd"] == slope.sd
    assert told["interval90"] == pytest.approx([slope.value - 1.645 * slope.sd, slope.value + 1.645 * slope.sd])
    row = html_page(found.diagnosis, found.pictures).split(slope.expression)[1].split("</tr>")[0]
    low, high = (f"{bound:.2g}" for bound in slope.known.interval90)
    assert low in row
    assert high in row


# --- groups -----------------------------------------------------------------------------------------------------------


def in_groups(*, of: int = 20, seed: int = 4) -> Measured:
    """Six specimens that differ by 10 %, each measured `of` times with a scatter of 1 %, one mass each."""
    rng = np.random.default_rng(seed)
    group = np.repeat(np.arange(6), of)
    friction = 0.4 * np.exp(rng.normal(0.0, 0.1, 6)[group] + rng.normal(0.0, 0.01, 6 * of))
    load = np.geomspace(0.1, 1.0, 6)[group]
    columns = {"friction_coefficient": friction, "normal_load_n": load, "sliding_speed_m_s": np.full(6 * of, 0.01)}
    return measured(columns, group=tuple(f"specimen {one}" for one in group))


def test_folds_leave_out_whole_groups() -> None:
    seen = table_evidence(in_groups(), Setting())
    fold = assigned(seen, np.random.default_rng(1))
    assert seen.group is not None
    assert len(np.unique(fold)) == 5
    assert all(len(np.unique(fold[seen.group == one])) == 1 for one in range(6))


@pytest.mark.parametrize("seed", range(4, 8))
def test_what_differs_between_six_specimens_is_no_law_of_their_loads(seed: int) -> None:
    """Taken for independent rows, 120 of them would show any slope over six levels."""
    found = examined(in_groups(seed=seed), catalogue()).diagnosis
    assert found.verdict == "not supported"


# --- a rig's table ----------------------------------------------------------------------------------------------------


def test_blocks_that_leaned_on_the_foam_are_left_out() -> None:
    rows = samples()
    free_m = np.where(np.arange(len(rows)) < 15, -1e-3, 5e-3)
    seen = table_evidence(replace(Measured.of(rows), more={"foam_free_m": free_m}), Setting())
    assert seen.used() == len(rows) - 15
    assert "15 rows of blocks that lay against the foam were left out" in seen.notes


def test_a_row_that_is_repeated_is_one_measurement() -> None:
    """Three copies of each row look like runs that do not scatter: what differs between them is taken for an effect."""
    rows = samples()
    seen = table_evidence(Measured.of([one for one in rows for _ in range(3)]), Setting())
    assert seen.used() == seen.total_runs == len(rows)
    assert f"{2 * len(rows)} rows repeat a row of the same run or time in all cells and were left out" in seen.notes


def test_equal_rows_that_no_run_or_time_tells_apart_are_measurements_of_their_own() -> None:
    columns = {"friction_coefficient": np.full(30, 0.35), "normal_load_n": np.full(30, 1.0)}
    assert table_evidence(measured(columns), Setting()).used() == 30
    groups = tuple(f"specimen {row // 10}" for row in range(30))
    assert table_evidence(measured(columns, run=np.arange(30) % 10, group=groups), Setting()).used() == 30
    rounded = {"friction_coefficient": np.round(0.35 + 0.01 * (np.arange(60) % 4), 2)}
    assert table_evidence(measured(rounded, run=np.arange(60) // 20), Setting()).used() == 60, "20 rows in each run"


def test_ignored_columns_are_named() -> None:
    seen = table_evidence(replace(Measured.of(samples()), ignored=("operator", "cycle")), Setting())
    assert "columns that nothing reads were left alone: operator, cycle" in seen.notes


def test_the_reason_why_nothing_can_be_tested_is_noted_once() -> None:
    level = tuple(replace(sample, onset_angle_rad=0.01) for sample in samples())
    notes = examined(Measured.of(level), catalogue()).diagnosis.notes
    assert sum("no row of the table has an onset angle" in note for note in notes) == 1
