"""Models of several effects, and their tables."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
import pytest

from shared.errors import UserError
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term, model_of_table, table_of_model
from station.physics.parameter import Parameter
from tests.contracts.effect_states import contacts, views

KNOWN = catalogue()
TEXT = """
about = "found by diagnose"
[friction]
mu_s = 0.36
scatter = 0.12
[effects.contact_aging]
per_decade = 0.031
[effects.stribeck]
drop = 0.2
"""


def table(**changes: Any) -> dict[str, Any]:
    """A good table with some of its keys replaced."""
    return tomllib.loads(TEXT) | changes


def model(**effects: dict[str, float]) -> Model:
    """mu 0.4 with effects."""
    return model_of_table({"friction": {"mu_s": 0.4}, "effects": effects}, KNOWN)


def test_a_table_is_read() -> None:
    """A shape may be left out: it starts where the effect says."""
    read = model_of_table(table(), KNOWN)
    assert (read.mu_s, read.scatter) == (0.36, 0.12)
    assert [term.effect.id for term in read.terms] == ["contact_aging", "stribeck"]
    assert read.terms[1].values["speed_m_s"] == KNOWN["stribeck"].neutral()["speed_m_s"]


def test_whole_numbers_are_numbers() -> None:
    """TOML knows 0 and 0.0."""
    assert model(backlash={"half_width_rad": 0}).terms[0].values == {"half_width_rad": 0.0}


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"friction": {}}, "Expected mu_s in the table"),
        ({"friction": {"mu_s": -0.1}}, "a number between 0 and 20 for friction.mu_s, got -0.1"),
        ({"friction": {"mu_s": True}}, "friction.mu_s, got True"),
        ({"friction": {"mu_s": "0.4"}}, "friction.mu_s, got '0.4'"),
        ({"friction": {"mu_s": 0.4, "scatter": 1.0}}, "friction.scatter, got 1.0"),
        ({"friction": {"mu_s": 0.4, "mu_k": 0.3}}, r"mu_s, scatter in \[friction\], got mu_k"),
        ({"effect": {}}, "in a model, got effect"),
        ({"effects": {"ageing": {}}}, "Expected one of the effects adhesion, .*, got ageing"),
        ({"effects": {"stribeck": {}}}, r"Expected drop in \[effects.stribeck\], found none"),
        ({"effects": {"stribeck": {"drop": 0.1, "speed": 1}}}, r"\[effects.stribeck\], got speed"),
        (
            {"effects": {"viscous": {"drag_n_s_m": -0.1}}},
            "Expected a number from 0 to 2 N s/m for effects.viscous.drag_n_s_m",
        ),
        ({"effects": {"wear": {"fall": 0.1, "runs": 0}}}, "effects.wear.runs, got 0"),
    ],
)
def test_a_wrong_table_gives_one_sentence(wrong: dict[str, Any], said: str) -> None:
    """The sentence says which key, what was expected, and what came."""
    with pytest.raises(UserError, match=said):
        model_of_table(table(**wrong), KNOWN)


def test_a_table_is_written_as_it_is_read() -> None:
    """Shapes included, from then on."""
    once = model_of_table(table(), KNOWN)
    assert model_of_table(table_of_model(once), KNOWN) == once


def test_friction_multiplies_and_pushes_add() -> None:
    """Effects do not know each other."""
    state = contacts()
    both = model(
        kinetic_drop={"drop": 0.2},
        wear={"fall": 0.1},
        viscous={"drag_n_s_m": 0.1},
        adhesion={"force_n": 0.01},
    )
    drop, wear = model(kinetic_drop={"drop": 0.2}), model(wear={"fall": 0.1})
    np.testing.assert_allclose(both.friction(state), drop.friction(state) * wear.friction(state) / 0.4)
    parts = model(viscous={"drag_n_s_m": 0.1}).push(state) + model(adhesion={"force_n": 0.01}).push(state)
    np.testing.assert_allclose(both.push(state), parts)


def test_a_whole_number_is_a_coefficient() -> None:
    """Whoever builds a model in Python may write 1 for 1.0."""
    state, terms = contacts(moving=True), model(kinetic_drop={"drop": 0.2}).terms
    whole, real = (Model(mu_s=mu_s, terms=terms) for mu_s in (1, 1.0))
    assert whole.friction(state).tolist() == real.friction(state).tolist()
    assert whole.steering(state).tolist() == real.steering(state).tolist()


def test_displacements_and_delays_add() -> None:
    """The image shows the sum."""
    view = views()
    sag, lens = model(camera_sag={"shift_m": 1e-3}), model(lens_distortion={"k1": 0.05})
    both = model(camera_sag={"shift_m": 1e-3}, lens_distortion={"k1": 0.05}, clock_offset={"delay_s": 0.03})
    np.testing.assert_allclose(both.seen(view), sag.seen(view) + lens.seen(view))
    assert both.delay_s() == 0.03


def test_a_corner_is_seen_where_its_row_is_read() -> None:
    """A lens shows it in another row, a millimetre on its way from the sum of both displacements."""
    view = views(acceleration_m_s2=np.random.default_rng(3).normal(0.0, 3.0, (60, 2)))
    both = model(rolling_shutter={"readout_s": 0.02}, lens_distortion={"k1": 0.1})
    shown = view.point_m + both.seen(view)
    late_s = 0.02 * ((shown - view.image_centre_m) @ view.row_m) / view.image_size_m
    then = view.later(late_s)
    np.testing.assert_allclose(shown, then.point_m + model(lens_distortion={"k1": 0.1}).seen(then), atol=2e-6)
    each = [
        model(**one).seen(view) for one in ({"rolling_shutter": {"readout_s": 0.02}}, {"lens_distortion": {"k1": 0.1}})
    ]
    assert np.abs(both.seen(view) - sum(each)).max() > 3e-4


def test_only_terms_off_their_null_act() -> None:
    """A nominal term costs nothing."""
    nominal = model(wear={"fall": 0.0}, kinetic_drop={"drop": 0.1})
    assert [term.effect.id for term in nominal.acting("friction")] == ["kinetic_drop"]
    assert nominal.acting("push") == ()


def test_a_term_is_replaced_and_not_doubled() -> None:
    """One effect, one set of values."""
    first = model(wear={"fall": 0.1})
    again = first.with_term(first.terms[0].with_values(fall=0.2))
    assert [dict(term.values) for term in again.terms] == [{"fall": 0.2, "runs": 50.0}]
    assert first.terms[0].values["fall"] == 0.1
    assert len(again.with_term(Term(KNOWN["kinetic_drop"], {"drop": 0.1})).terms) == 2


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"low": 1.0}, "low < high"),
        ({"null": -0.5}, "its null value -0.5 is outside"),
        ({"null": None}, "needs values to start from"),
        ({"typical": 0.0}, "positive typical size"),
    ],
)
def test_a_parameter_that_cannot_be_fitted_is_refused(wrong: dict[str, Any], said: str) -> None:
    """Found when the file is imported, not in the middle of a fit."""
    good: dict[str, Any] = {"name": "x", "unit": "1", "low": 0.0, "high": 1.0, "typical": 0.1}
    assert Parameter(**good).clipped(7.0) == 1.0
    with pytest.raises(ValueError, match=said):
        Parameter(**(good | wrong))
