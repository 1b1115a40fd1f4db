"""Every effect keeps its promises: every file in station/physics/effects."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shared.errors import UserError
from station.physics.catalogue import catalogue, confused
from station.physics.effect import Effect, Values
from station.physics.model import Model, Term, model_of_table, table_of_model
from station.physics.parameter import Parameter
from tests.contracts.effect_states import NEUTRAL, answer, contacts, read_only, some_of, typical, views

KNOWN = catalogue()
EVERY = pytest.mark.parametrize("effect", KNOWN.values(), ids=KNOWN.keys())
FIXED_IDS = frozenset(
    {
        "kinetic_drop",
        "stribeck",
        "rate_strengthening",
        "viscous",
        "contact_aging",
        "wear",
        "object_anisotropy",
        "plate_anisotropy",
        "one_way_friction",
        "friction_patch",
        "adhesion",
        "load_dependence",
        "presliding",
        "com_offset",
        "uneven_contact",
        "border_contact",
        "tipping",
        "platform_level",
        "angle_scale",
        "backlash",
        "pivot_offset",
        "arm_vibration",
        "clock_offset",
        "camera_sag",
        "lens_distortion",
        "rolling_shutter",
        "solver_creep",
        "cone_artifact",
    }
)


FIELDS_LETTERS = frozenset("Nvmgtsupcxra")
"""Letters of a law that no parameter stands for: those of the field (a load, a speed, a time), a function's argument, a
point and its centre, a product and its arm, and the article."""


def acting(hook: str) -> list[Effect]:
    """The effects that act through a method."""
    return [effect for effect in KNOWN.values() if hook in effect.acts_through()]


def through(hook: str) -> pytest.MarkDecorator:
    """Once for each effect that acts through a method."""
    return pytest.mark.parametrize("effect", acting(hook), ids=lambda effect: effect.id)


def nulls(effect: Effect) -> Iterator[dict[str, float]]:
    """The null, with every start of every shape."""
    yield effect.neutral()
    for shape in effect.parameters:
        for start in shape.starts:
            yield effect.neutral() | {shape.name: start}


def corners(effect: Effect) -> Iterator[dict[str, float]]:
    """All values at their lower bounds, at their upper bounds, and each alone there."""
    for side in ("low", "high"):
        yield {one.name: getattr(one, side) for one in effect.parameters}
        for one in effect.parameters:
            yield typical(effect) | {one.name: getattr(one, side)}


def allowed(effect: Effect) -> st.SearchStrategy[dict[str, float]]:
    """Any values within the bounds."""
    return st.fixed_dictionaries({one.name: st.floats(one.low, one.high) for one in effect.parameters})


def test_every_fixed_id_is_there() -> None:
    """The identifiers of the report never change."""
    assert not FIXED_IDS - set(KNOWN)


# --- what it says of itself -----------------------------------------------------------------------------------------


@EVERY
def test_each_letter_of_its_law_is_a_parameters(effect: Effect) -> None:
    words = set(re.findall(r"\w+", effect.law))
    letters = {word for word in words if re.fullmatch(r"[A-Za-z]\d?", word)}
    symbols = {symbol for one in effect.parameters if one.symbol for symbol in one.symbol.split()} - {"log10"}
    assert symbols <= words, "a symbol that the law does not have"
    assert letters <= symbols | {one.name for one in effect.parameters} | FIELDS_LETTERS


@EVERY
def test_says_what_it_is(effect: Effect) -> None:
    """A law with its null, a dated or named source, and the neighbours it can be taken for."""
    assert "0" in effect.law, "the law does not say at which value it vanishes"
    assert re.search(r"(1[789]|20)\d\d|et al\.|Dressel|Landau", effect.source)
    assert set(effect.confounded_with) <= set(KNOWN) - {effect.id}
    assert len(effect.separated_by.split()) >= 4
    assert type(effect).__doc__
    assert effect.acts_through()


@EVERY
def test_parameters_have_units_and_sane_starts(effect: Effect) -> None:
    """Parameters that scale a fit must lie inside the bounds."""
    assert any(not one.is_shape for one in effect.parameters)
    for one in effect.parameters:
        assert one.name.isidentifier()
        assert one.unit
        assert all(one.low <= start <= one.high for start in one.starts)
        assert one.typical <= one.high


@EVERY
def test_confusion_is_mutual(effect: Effect) -> None:
    """Effects that cannot be told apart say so of each other; none stands so alone that it needs no test."""
    others = confused(KNOWN, effect.id)
    assert others
    assert effect.id not in others
    assert all(effect.id in confused(KNOWN, other) for other in others)


# --- numbers ----------------------------------------------------------------------------------------------------------


@EVERY
def test_vanishes_exactly_at_its_null(effect: Effect) -> None:
    """A nominal arm must be the same to the last bit, not nearly."""
    for values in nulls(effect):
        assert effect.is_null(values)
        for hook in effect.acts_through():
            assert np.all(answer(effect, hook, values) == NEUTRAL[hook]), hook


@EVERY
def test_acts_at_its_typical_size(effect: Effect) -> None:
    """Every method that is overridden does something."""
    values = typical(effect)
    assert not effect.is_null(values)
    for hook in effect.acts_through():
        assert np.any(answer(effect, hook, values) != NEUTRAL[hook]), hook


@EVERY
def test_finite_at_every_corner(effect: Effect) -> None:
    """Bounds are places that a fit visits."""
    for values in corners(effect):
        for hook in effect.acts_through():
            assert np.all(np.isfinite(answer(effect, hook, values))), (hook, values)


@EVERY
@given(data=st.data())
@settings(max_examples=25, deadline=None)
def test_finite_and_never_driving(effect: Effect, data: st.DataObject) -> None:
    """Anywhere within the bounds: finite, friction and shaking at least 0."""
    values = data.draw(allowed(effect))
    for hook in effect.acts_through():
        said = answer(effect, hook, values)
        assert np.all(np.isfinite(said)), hook
        assert hook not in {"friction", "shaking"} or np.all(said >= 0), hook


@EVERY
def test_each_moment_stands_alone(effect: Effect) -> None:
    """The answer for a moment does not depend on which others are asked about."""
    chosen = np.array([3, 11, 40])
    for hook in effect.acts_through() - {"delay_s"}:
        state = views() if hook == "seen" else contacts()
        alone = answer(effect, hook, typical(effect), some_of(state, chosen))
        np.testing.assert_allclose(alone, answer(effect, hook, typical(effect), state)[chosen], rtol=1e-12, atol=1e-15)


@EVERY
def test_nothing_happens_to_no_moments(effect: Effect) -> None:
    """An empty selection is a selection."""
    nothing = np.array([], dtype=int)
    for hook in effect.acts_through() - {"delay_s"}:
        state = views() if hook == "seen" else contacts()
        assert answer(effect, hook, typical(effect), some_of(state, nothing)).shape[0] == 0


def slope(effect: Effect, hook: str, values: dict[str, float], one: Parameter, step: float) -> Any:
    """The difference quotient from the null."""
    moved = answer(effect, hook, values | {one.name: values[one.name] + step})
    return (moved - answer(effect, hook, values)) / step


@EVERY
def test_smooth_at_the_null(effect: Effect) -> None:
    """The derivative from each allowed side exists, and both are the same: a score test and a fit need it."""
    for values in nulls(effect):
        for one in effect.parameters:
            if one.null is None:
                continue
            sides = [side for side in (1.0, -1.0) if one.low <= one.null + side * one.typical * 1e-3 <= one.high]
            for hook in effect.acts_through():
                found = [
                    slope(effect, hook, values, one, side * one.typical * size)
                    for side in sides
                    for size in (1e-3, 1e-4, 1e-5)
                ]
                # An even effect has no slope here: its whole change up to the typical size is the scale.
                steep = [*found, slope(effect, hook, values, one, sides[0] * one.typical)]
                scale = max(float(np.max(np.abs(np.stack(steep)), initial=0.0)), 1e-9)
                assert all(np.max(np.abs(other - found[0])) < 0.02 * scale for other in found), (hook, one.name)


# --- physics ----------------------------------------------------------------------------------------------------------


@through("friction")
@pytest.mark.parametrize("moving", [False, True])
@given(data=st.data())
@settings(max_examples=15, deadline=None)
def test_limit_curve_is_convex(effect: Effect, moving: bool, data: st.DataObject) -> None:
    """h + h'' ≥ 0, as h(φ + d) + h(φ − d) ≥ 2 cos(d) h(φ), which holds at kinks as well: of the curve that steers."""
    values = data.draw(allowed(effect))
    one = some_of(contacts(moving=moving, seed=data.draw(st.integers(0, 50))), np.zeros(360, dtype=int))
    way = np.radians(np.arange(360.0))
    around = answer(effect, "steering", values, replace(one, way_rad=read_only(way)))
    for turn in (1, 5, 30):
        bent = np.roll(around, turn) + np.roll(around, -turn) - 2.0 * np.cos(np.radians(turn)) * around
        assert np.min(bent) >= -1e-9 * np.max(around)


def power(effect: Effect, values: Values, state: Any) -> Any:
    """Returns the power (n,), W/kg, that the part of a push that depends on the speed does on the motion.

    An arm that shakes the plate does work on a slide and none on a block at rest, whatever the speed.
    """
    moving = state.moving if "shaking" in effect.acts_through() else np.zeros(len(state), dtype=bool)
    slowest = replace(state, moving=moving, speed_m_s=np.zeros(len(state)))
    push = answer(effect, "push", values, state) - answer(effect, "push", values, slowest)
    return np.sum(push[:, :2] * state.way, axis=1) * state.speed_m_s


@through("push")
@given(data=st.data())
@settings(max_examples=25, deadline=None)
def test_a_push_by_speed_takes_energy(effect: Effect, data: st.DataObject) -> None:
    """Damping only."""
    assert np.all(power(effect, data.draw(allowed(effect)), contacts(moving=True)) <= 1e-12)


@through("push")
@pytest.mark.parametrize("values", ["typical", "low", "high"])
def test_a_push_does_no_work_on_the_way_out_and_back(effect: Effect, values: str) -> None:
    """Into the foam and out again, at a steady speed: what a spring takes it may give back, and no more."""
    chosen = typical(effect) if values == "typical" else {one.name: getattr(one, values) for one in effect.parameters}
    out = np.linspace(0.02, 0.04, 201)
    same = some_of(contacts(moving=True, border_m=0.0), np.zeros(len(out), dtype=int))
    state = replace(same, x_m=out, y_m=np.zeros(len(out)), border_m=0.03 - out, speed_m_s=np.full(len(out), 0.1))
    there = answer(effect, "push", chosen, replace(state, way_rad=np.zeros(len(out))))[:, 0]
    back = answer(effect, "push", chosen, replace(state, way_rad=np.full(len(out), np.pi)))[:, 0]
    assert np.trapezoid(there, out) - np.trapezoid(back, out) <= 1e-9


@through("spin")
def test_nothing_turns_at_rest(effect: Effect) -> None:
    """A block that rests has no sliding friction to turn it."""
    assert np.all(answer(effect, "spin", typical(effect), contacts(moving=False)) == 0)


@through("lever")
def test_friction_turns_nothing_at_rest(effect: Effect) -> None:
    """A block that rests has no sliding friction to turn it."""
    assert np.all(answer(effect, "lever", typical(effect), contacts(moving=False)) == 0)


@through("creep")
def test_creep_goes_down_and_ends_with_the_slide(effect: Effect) -> None:
    """Uphill would be energy from nowhere; a sliding block has its own velocity."""
    state = contacts(moving=False)
    assert np.all(np.sum(answer(effect, "creep", typical(effect), state) * state.down, axis=1) >= 0)
    assert np.all(answer(effect, "creep", typical(effect), contacts(moving=True)) == 0)


@EVERY
def test_reasons_are_one_sentence(effect: Effect) -> None:
    """Whatever the onsets, a refusal is None or one sentence."""
    one_mass = contacts(moving=False, mass_kg=0.02, rising=1.0, tilt_rad=0.3)
    for onsets in (contacts(moving=False), one_mass, some_of(one_mass, np.array([0]))):
        reason = effect.why_untestable(onsets)
        assert reason is None or (reason[0].isupper() and reason.endswith(".") and "\n" not in reason)


# --- in a model -------------------------------------------------------------------------------------------------------


@EVERY
def test_signs_and_bounds_are_enforced(effect: Effect) -> None:
    """A value outside the bounds is refused by name; the bounds themselves are not."""
    for one in effect.parameters:
        for beyond in (one.low - one.typical, one.high + one.typical, float("nan")):
            table = {"friction": {"mu_s": 0.4}, "effects": {effect.id: typical(effect) | {one.name: beyond}}}
            with pytest.raises(UserError, match=f"effects.{effect.id}.{one.name}"):
                model_of_table(table, KNOWN)


@EVERY
def test_a_model_goes_through_its_table(effect: Effect) -> None:
    """A written model is read back the same."""
    model = Model(mu_s=0.4, scatter=0.1, terms=(Term(effect, typical(effect)),))
    assert model_of_table(table_of_model(model), KNOWN) == model


@EVERY
def test_a_term_at_its_null_changes_no_bit_of_a_model(effect: Effect) -> None:
    """The model with the effect at its null is the model without it."""
    plain, state, view = Model(mu_s=0.37, scatter=0.1), contacts(), views()
    nominal = plain.with_term(Term(effect, effect.neutral()))
    for hook in ("friction", "push", "spin", "lever", "attitude", "creep", "shaking"):
        assert np.array_equal(getattr(nominal, hook)(state), getattr(plain, hook)(state))
    assert np.array_equal(nominal.seen(view), plain.seen(view))
    assert nominal.delay_s() == 0
