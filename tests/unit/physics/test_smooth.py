"""Terms without a name, and their tables in model.toml."""

from __future__ import annotations

import pickle
import tomllib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import tomli_w

from shared.errors import UserError
from station.physics import smooth_table as module
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term, model_of_table, table_of_model
from station.physics.smooth import (
    ByRun,
    Form,
    Harmonics,
    Powers,
    Push,
    PushAside,
    Smooth,
    SmoothPush,
    Swings,
    Unnamed,
    When,
    is_smooth,
    pushes,
)
from tests.contracts.effect_states import contacts

KNOWN = catalogue()
BOTH: frozenset[When] = frozenset({"onset", "sliding"})
ONSET: frozenset[When] = frozenset({"onset"})
FORMS: tuple[tuple[str, Form], ...] = (
    ("direction", Harmonics(waves=(("cos", 1), ("sin", 1), ("cos", 3)))),
    ("slide_to_block", Harmonics(waves=(("sin", 2),))),
    ("run", Powers(middle=75.0, spread=135.0, degree=3)),
    ("run", Swings(low=0.0, width=149.0, often=2.5)),
)
EFFECTS: tuple[Unnamed, ...] = (
    *(Smooth(covariate, form, at=BOTH) for covariate, form in FORMS),
    Smooth("dwell", Powers(middle=1.0, spread=0.5, degree=1), at=ONSET),
    Smooth("speed", Powers(middle=0.1, spread=0.1, degree=2), at=frozenset({"sliding"})),
    Smooth(
        "turned",
        Harmonics(waves=(("cos", 1),)),
        at=BOTH,
        by_run=ByRun(np.arange(5.0), np.array([0.5, np.nan, 1.0, 2.0, -1.0])),
    ),
    *pushes(),
)


def values_of(effect: Unnamed) -> dict[str, float]:
    """Different ones for each coefficient."""
    return {one.name: 0.08 - 0.03 * number for number, one in enumerate(effect.parameters)}


def table(**changes: Any) -> dict[str, Any]:
    """A model with one smooth term, of which some keys are changed; None leaves a key out."""
    term = {"covariate": "run", "powers": {"middle": 50.0, "spread": 60.0}, "coefficients": [0.1]} | changes
    return {"friction": {"mu_s": 0.4}, "smooth": [{name: value for name, value in term.items() if value is not None}]}


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.id)
def test_a_written_term_is_read_as_it_was(effect: Unnamed) -> None:
    model = Model(mu_s=0.4, terms=(Term(KNOWN["wear"], {"fall": 0.1, "runs": 20.0}), Term(effect, values_of(effect))))
    again = model_of_table(tomllib.loads(tomli_w.dumps(table_of_model(model))), KNOWN)
    assert again == model
    assert is_smooth(again.terms[1].effect)
    state = replace(contacts(7), run=np.arange(7.0) - 1.0)
    assert np.array_equal(again.friction(state), model.friction(state))
    assert np.array_equal(again.push(state), model.push(state))
    assert table_of_model(again) == table_of_model(model)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.id)
def test_it_vanishes_at_its_null_and_acts_beside_it(effect: Unnamed) -> None:
    state = replace(contacts(7), run=np.arange(7.0))
    null, off = effect.neutral(), values_of(effect)
    assert effect.is_null(null)
    assert not effect.is_null(off)
    assert effect.acts_through() == ({"push"} if isinstance(effect, Push) else {"friction"})
    assert np.all(np.asarray(effect.friction(state, null)) == 1.0)
    push = effect.push(state, null)
    assert push is None or not push.any()
    pushed = effect.push(state, off)
    assert np.ptp(np.asarray(effect.friction(state, off))) > 0 or (pushed is not None and pushed.any())


def test_a_term_acts_only_when_it_is_said_to() -> None:
    form = Powers(middle=0.0, spread=1.0, degree=1)
    for at, acting in ((ONSET, ~contacts().moving), (frozenset[When]({"sliding"}), contacts().moving)):
        term = Smooth("run", form, at=at)
        state = replace(contacts(), run=np.full(len(contacts()), 0.5))
        assert np.array_equal(np.asarray(term.friction(state, {"a0": 0.1})) != 1.0, acting)
    assert contacts().moving.any()
    assert not contacts().moving.all()


@pytest.mark.parametrize("form", [form for _, form in FORMS], ids=lambda form: form.words)
def test_what_is_not_known_changes_nothing(form: Form) -> None:
    assert not form.of(np.array([np.nan])).any()
    assert form.of(np.zeros(3)).shape == (3, form.size)


def test_a_polynomial_says_nothing_beyond_what_was_seen() -> None:
    form = Powers(middle=10.0, spread=2.0, degree=2)
    assert form.of(np.array([10.0, 11.0, 99.0])).tolist() == [[0.0, 0.0], [0.5, 0.25], [1.5, 2.25]]


def test_a_run_that_was_not_seen_is_as_if_it_were_not_known() -> None:
    turned = Smooth("turned", Harmonics(waves=(("cos", 1),)), at=BOTH, by_run=ByRun(np.array([2.0]), np.array([0.0])))
    state = replace(contacts(3), run=np.array([1.0, 2.0, 3.0]))
    assert np.asarray(turned.friction(state, {"a0": 0.1})) == pytest.approx([1.0, np.exp(0.1), 1.0])


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.id)
def test_a_term_travels_to_another_process(effect: Unnamed) -> None:
    state = replace(contacts(4), run=np.arange(4.0))
    again = pickle.loads(pickle.dumps(effect))
    assert again == effect
    assert np.array_equal(again.friction(state, values_of(effect)), effect.friction(state, values_of(effect)))


def test_the_examples_can_be_read() -> None:
    """The module shows these examples."""
    _, _, text = (module.__doc__ or "").partition("\n\n")
    examples, _, _ = text.partition("\nA covariate")
    model = model_of_table(tomllib.loads(examples) | {"friction": {"mu_s": 0.4}}, KNOWN)
    assert len({term.effect.id for term in model.terms}) == 5


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"covariate": "colour"}, "Expected one of direction, .* as a covariate of .*, got 'colour'"),
        ({"coefficients": None}, "covariate and coefficients"),
        ({"coefficients": 0.1}, "a list of numbers for coefficients"),
        ({"coefficients": [7.0]}, "Expected a number from -1 to 1 for a coefficient"),
        ({"coefficients": ["a"]}, "finite numbers for coefficients .*, got 'a'"),
        ({"powers": None}, "one of powers, harmonics, swings .*, got none"),
        ({"powers": {"middle": 1.0}}, "middle, spread for powers"),
        ({"powers": {"middle": 1.0, "spread": 0.0}}, "a positive number for powers.spread"),
        ({"swings": {"low": 0.0, "width": 1.0, "often": 1.0}}, "got powers, swings"),
        ({"powers": None, "swings": {"low": 0.0, "width": 1.0, "often": 1.0}}, "Expected 2 coefficients .*, got 1"),
        ({"powers": None, "harmonics": ["tan 1"]}, r"harmonics such as \[\"cos 1\", \"sin 1\"\].*tan 1"),
        ({"at": "onset"}, "one or both of onset, sliding for at .*, got 'onset'"),
        ({"at": ["later"]}, "got \\['later'\\]"),
        ({"colour": 1}, "got colour"),
        ({"runs": [1, 2], "values": [0.1]}, "as many runs as values .*, got 2 and 1"),
        ({"runs": [1, 2]}, "a list of numbers for values"),
        ({"powers": None, "push": "aside", "covariate": "position"}, "got push = 'aside' by 'position'"),
        ({"powers": None, "push": "up"}, "a push of radial, .*, field by position or aside by way .*, got push = 'up'"),
    ],
)
def test_a_wrong_table_gives_one_sentence(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(UserError, match=said):
        model_of_table(table(**changes), KNOWN)


def test_a_term_comes_once() -> None:
    twice = table() | {"smooth": 2 * table()["smooth"]}
    with pytest.raises(UserError, match="'run, degree 1' comes twice"):
        model_of_table(twice, KNOWN)
    with pytest.raises(UserError, match=r"Expected tables \[\[smooth\]\]"):
        model_of_table(table() | {"smooth": {"covariate": "run"}}, KNOWN)


def test_a_field_does_no_work_around_a_loop() -> None:
    """The slope of a hill: what a block gains on one side it pays on the other, whatever the coefficients."""
    turn = np.linspace(0.0, 2.0 * np.pi, 2000, endpoint=False)
    place = np.column_stack([0.004 + 0.02 * np.cos(turn), -0.007 + 0.015 * np.sin(turn)])
    state = replace(contacts(len(turn)), x_m=place[:, 0], y_m=place[:, 1])
    field = SmoothPush("field")
    values = dict(zip(field.neutral(), np.random.default_rng(1).normal(0.0, 0.1, 14), strict=True))
    push = field.push(state, values)
    assert push is not None
    step = np.roll(place, -1, axis=0) - np.roll(place, 1, axis=0)
    work = 0.5 * np.sum(push[:, :2] * step, axis=1)
    assert abs(work.sum()) < 1e-6 * np.abs(work).sum()
    assert np.abs(work).sum() > 1e-4


def test_what_is_pushed_aside_is_pushed_to_the_left_of_its_way_and_only_while_it_slides() -> None:
    state = contacts(50)
    push = PushAside().push(state, {"a0": 0.03})
    assert push is not None
    ahead = np.column_stack([np.cos(state.way_rad), np.sin(state.way_rad)])
    assert (push[:, :2] * ahead).sum(axis=1) == pytest.approx(np.zeros(50), abs=1e-12)
    turned_left = ahead[:, 0] * push[:, 1] - ahead[:, 1] * push[:, 0]
    assert turned_left == pytest.approx(0.03 * state.moving)
