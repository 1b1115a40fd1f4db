"""The next experiment changes what the recording leaves together, and promises no more than its own sessions keep."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import Mock

import numpy as np
import pytest

from station.diagnosis.likelihood.slopes import residuals
from station.diagnosis.next_experiment import plan
from station.diagnosis.next_experiment.changes import BY_HAND_S, SINGLE, Change, run_s
from station.diagnosis.next_experiment.choice import Bench, Choice, protocol_of, sessions
from station.diagnosis.next_experiment.on_paper import NOISE, on_paper, standard
from station.diagnosis.next_experiment.open_shapes import open_shapes
from station.diagnosis.next_experiment.outlook import (
    DRAWS,
    Outlook,
    Question,
    Rival,
    all_candidates,
    drawn,
    fewest_candidates,
    outlook,
)
from station.diagnosis.next_experiment.plan import most_promising, separate
from station.diagnosis.next_experiment.redone import Draw, redone
from station.diagnosis.next_experiment.words import by_hand, in_words
from station.diagnosis.result import Value
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term

KNOWN = catalogue()
RUNS = 120


POWER_SD = 0.5 / math.sqrt(DRAWS)
"""The largest standard deviation of a power from so many draws."""


def paper(**changes: np.ndarray[tuple[int], np.dtype[np.float64]]) -> Draw:
    return standard(np.random.default_rng(3), RUNS) | changes


def question(*terms: Term, mu_s: float = 0.4) -> Question:
    return Question(
        rivals=tuple(Rival(term) for term in terms),
        ids=tuple(term.effect.id for term in terms),
        beside=Model(mu_s=mu_s),
        noise=NOISE,
        effects=tuple(KNOWN.values()),
    )


AGEING = Term(KNOWN["contact_aging"], {**KNOWN["contact_aging"].neutral(), "per_decade": 0.1})
WEAR = Term(KNOWN["wear"], {**KNOWN["wear"].neutral(), "fall": 0.2})


def test_where_order_and_cause_coincide_the_cause_is_drawn_at_random() -> None:
    """Each run rests less than the one before: wear and ageing go together until the dwell is random."""
    falling = paper(dwell_s=np.geomspace(30.0, 0.3, RUNS))
    plan = separate([KNOWN["wear"], KNOWN["contact_aging"]], KNOWN, protocol=falling)
    assert "random" in plan.why
    assert "[dwell]" in plan.plan or "rates_deg_s" in plan.plan  # a session draws both anew for every run
    assert plan.power >= 0.8


DRAWN = {"dwell": "dwell_s", "direction": "down", "mass": "mass_kg", "heading": "yaw", "place": "x"}


@pytest.mark.parametrize("change", SINGLE, ids=lambda change: change.factor)
def test_a_change_has_no_order_left(change: Change) -> None:
    """A changed factor does not depend on the run's number, wherever it did before."""
    rows = np.arange(float(RUNS))
    tied = paper(dwell_s=rows + 1.0, mass_kg=rows + 1.0, mount=rows / RUNS, yaw=rows / RUNS, x=rows / 1e4, y=rows / 1e4)
    _, draw = protocol_of(on_paper(tied, mu_s=0.4), (change,), runs=100)
    drawn = draw[DRAWN.get(change.factor, change.factor)]
    assert abs(np.corrcoef(draw["number"], drawn)[0, 1]) < 3.0 / math.sqrt(len(drawn))


def test_what_was_done_is_not_proposed() -> None:
    """A block that already turns sets both grains apart: the same again is enough, and nothing is done by hand."""
    rivals = [KNOWN["plate_anisotropy"], KNOWN["object_anisotropy"]]
    turning = paper(yaw=np.random.default_rng(1).uniform(-np.pi, np.pi, RUNS))
    assert "by hand" in separate(rivals, KNOWN).plan
    done = separate(rivals, KNOWN, protocol=turning)
    assert "by hand" not in done.plan
    assert "block turned" not in done.why


def test_the_loads_are_named_and_those_that_were_tried() -> None:
    pair = [KNOWN["load_dependence"], KNOWN["adhesion"]]
    dealt = 0.01 * np.random.default_rng(2).permutation(np.linspace(0.4, 2.0, RUNS))
    (loads,) = (change for change in SINGLE if change.factor == "mass")
    said = in_words((loads,), paper(mass_kg=dealt), dwells=False)
    assert said == "loads of 6, 12, 24 and 60 g (so far 4 to 20 g) in random order"
    assert "×0.5, 1, 2 and 5" in separate(pair, KNOWN).why or "g in random order" in separate(pair, KNOWN).why


def test_loads_that_are_dealt_again_are_named_and_cost_a_hand() -> None:
    rising = paper(mass_kg=np.linspace(0.004, 0.02, RUNS))
    assert in_words((), rising, dwells=False) == "the same loads (4 to 20 g) again, in random order"
    assert by_hand((), rising) == [
        "change the block's mass as before (4 to 20 g), in random order, and name it in the rig file"
    ]
    same = paper()
    apart = run_s(rising, tilt_rad=0.4, changes=()) - run_s(same, tilt_rad=0.4, changes=())
    assert apart == pytest.approx(BY_HAND_S)
    assert by_hand((), same) == []


def test_a_nap_is_told_from_a_level_error_by_turning_the_plate() -> None:
    plan = separate([KNOWN["one_way_friction"], KNOWN["platform_level"]], KNOWN)
    assert "mount" in plan.plan


def test_what_no_plan_separates_is_advised_by_the_effects_themselves() -> None:
    """There is no plan then that could contradict them."""
    pair = [KNOWN["camera_sag"], KNOWN["presliding"]]
    plan = separate(pair, KNOWN)
    assert (plan.plan, plan.runs) == ("", 0)
    assert all(effect.separated_by in plan.why for effect in pair)
    assert plan.why.startswith("No single plan separates them. ")
    assert "they are separated by " in plan.why


@pytest.mark.parametrize(
    ("power", "words"),
    [
        (0.123, "The most promising one (the same again, in random order) would do so in 12 % of the sessions."),
        (0.004, "None of those that were tried would do so in even 1 % of the sessions."),
    ],
)
def test_a_plan_that_does_nothing_is_not_promising(power: float, words: str) -> None:
    bench = Bench(recorded=on_paper(paper(dwell_s=np.full(RUNS, 1.0)), mu_s=0.4))
    choice = Choice(changes=(), runs=RUNS, minutes=10.0, promise=Outlook(power=power, log_odds=0.0))
    assert most_promising(choice, bench) == words


def test_a_longer_session_promises_more() -> None:
    bench, asked = Bench(recorded=on_paper(paper(), mu_s=0.4)), question(AGEING, WEAR)
    trials = sessions(asked, bench, SINGLE[:1], runs=100)
    groups = [("contact_aging",), ("wear",)]
    power = [outlook(drawn(trials, runs=runs, rng=np.random.default_rng(1)), groups).power for runs in (20, 60, 200)]
    assert power == sorted(power)
    assert power[0] < power[-1]


@pytest.mark.parametrize("change", SINGLE[:3], ids=lambda change: change.factor)
def test_the_rivals_alone_promise_what_all_candidates_do_or_more(change: Change) -> None:
    """A design that does not reach enough with them alone need not be looked at with all."""
    bench, asked = Bench(recorded=on_paper(paper(), mu_s=0.4)), question(AGEING, WEAR)
    every, few = (
        drawn(sessions(asked, bench, (change,), runs=60, look=look), runs=60, rng=np.random.default_rng(1))
        for look in (all_candidates, fewest_candidates)
    )
    groups = [("contact_aging",), ("wear",)]
    assert outlook(few, groups).power >= outlook(every, groups).power - 3.0 * POWER_SD


VISCOUS = Term(KNOWN["viscous"], {"drag_n_s_m": 0.02, "by_load": 0.0})


def test_a_shape_that_one_mass_leaves_open_stands_for_each_value() -> None:
    """Runs of one mass do not tell if a drag grows with the load: either says the same of these."""
    evidence, beside = on_paper(paper(mass_kg=np.full(RUNS, 0.02)), mu_s=0.4).evidence, Model(mu_s=0.4)
    one, other = open_shapes(evidence, beside, Rival(VISCOUS, 0.8))
    assert [one.term.values["by_load"], other.term.values["by_load"]] == [0.0, 1.0]
    assert one.weight == other.weight == pytest.approx(0.4)
    both = [residuals(evidence, beside.with_term(each.term)) for each in (one, other)]
    for name, first in both[0].items():
        np.testing.assert_allclose(both[1][name], first, atol=1e-6)


def test_masses_that_varied_leave_no_shape_open() -> None:
    evidence = on_paper(paper(mass_kg=np.geomspace(0.005, 0.05, RUNS)), mu_s=0.4).evidence
    (only,) = open_shapes(evidence, Model(mu_s=0.4), Rival(VISCOUS))
    assert only.term is VISCOUS


def test_other_loads_promise_less_where_the_drag_may_grow_with_the_load() -> None:
    bench, beside = Bench(recorded=on_paper(paper(), mu_s=0.4)), Model(mu_s=0.4)
    rate = Term(
        KNOWN["rate_strengthening"], {"per_e_fold": 0.016, "slower_decades": 1.0, "both_ways": 0.0, "creep_share": 0.0}
    )
    known = question(VISCOUS, rate)
    opened = replace(known, rivals=(*open_shapes(bench.recorded.evidence, beside, known.rivals[0]), known.rivals[1]))
    loads = next(change for change in SINGLE if change.factor == "mass")
    groups = [("viscous",), ("rate_strengthening",)]
    power = [
        outlook(drawn(sessions(one, bench, (loads,), runs=60), runs=60, rng=np.random.default_rng(1)), groups).power
        for one in (known, opened)
    ]
    assert power[1] < power[0]


def test_the_same_question_has_the_same_answer() -> None:
    assert separate([KNOWN["viscous"]], KNOWN) == separate([KNOWN["viscous"]], KNOWN)


def test_a_session_done_again_unchanged_is_the_recorded_one() -> None:
    """Its residuals under an isotropic model are the recorded ones."""
    recorded, model = on_paper(paper(), mu_s=0.4), Model(mu_s=0.38)
    (again,) = redone(recorded, np.arange(RUNS), recorded.protocol(), truths=[model])
    before = residuals(recorded.evidence, model)
    for name, after in residuals(again, model).items():
        np.testing.assert_allclose(after, before[name], atol=1e-9)


def test_a_session_turned_about_the_normal_differs_for_no_isotropic_law() -> None:
    recorded, model = on_paper(paper(), mu_s=0.4), Model(mu_s=0.38).with_term(AGEING)
    draw = recorded.protocol()
    there = np.exp(1j) * (draw["x"] + 1j * draw["y"])
    moved = draw | {"down": draw["down"] + 1.0, "x": there.real, "y": there.imag}
    (turned,), (same,) = (redone(recorded, np.arange(RUNS), each, truths=[model]) for each in (moved, draw))
    before = residuals(same, model)
    for name, after in residuals(turned, model).items():
        np.testing.assert_allclose(after, before[name], atol=1e-9)


def test_the_number_to_be_narrowed_is_the_one_that_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    """A rival has the values of its own comparison, and of each shape that the recording left open."""
    grain, numbers = KNOWN["plate_anisotropy"], {"cos2": 0.1, "sin2": 0.0, "shape": 0.0}
    reported = {name: Value(value=value, sd=0.03, unit="1") for name, value in numbers.items()}
    asked: Any = SimpleNamespace(rivals=(Rival(Term(grain, numbers | {"cos2": 0.7})),))
    choice = Choice(changes=(), runs=40, minutes=20.0, promise=Outlook(power=1.0, log_odds=9.0), sd_ratio=0.5)
    for name, gives in (("narrowing", choice), ("_words", "a longer session"), ("_toml", "")):
        monkeypatch.setattr(plan, name, Mock(return_value=gives))
    found = plan.narrows(asked, cast("Any", None), cast("Any", SimpleNamespace(parameters=reported)))
    assert found is not None
    assert found.why.startswith("a longer session: this measures plate_anisotropy's")
    assert "now 0.100 ± 0.030" in found.why
