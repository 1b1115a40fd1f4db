"""A model beside whose friction the moment on a block at rest acts."""

from __future__ import annotations

import numpy as np
import pytest

from station.physics.catalogue import catalogue
from station.physics.model import Model, Term
from station.physics.unturned import unturned
from tests.contracts.effect_states import contacts

REST = contacts(50, moving=False)
SIZES = {
    "uneven_contact": {"x_m": 1e-3, "y_m": 5e-4, "lead": 0.0},
    "friction_patch": {"slope_x": 0.2, "bowl": 0.1, "length_m": 0.01, "turning": 2.0},
    "contact_aging": {"per_decade": 0.03},
}


def model(name: str) -> Model:
    effect = catalogue()[name]
    return Model(mu_s=0.4, terms=(Term(effect, {**effect.neutral(), **SIZES[name]}),))


@pytest.mark.parametrize("name", ["uneven_contact", "friction_patch"])
def test_a_moment_takes_nothing_of_the_friction_beside_which_it_acts(name: str) -> None:
    taken = model(name).friction(REST) / unturned(model(name)).friction(REST)
    assert taken.min() < 0.999
    assert taken.max() <= 1.0


def test_friction_by_the_place_stays() -> None:
    held = unturned(model("friction_patch"))
    plain = model("friction_patch").terms[0]
    even = Model(mu_s=0.4, terms=(plain.with_values(turning=0.0),))
    np.testing.assert_array_equal(held.friction(REST), even.friction(REST))


def test_what_turns_nothing_is_as_it_was() -> None:
    assert unturned(model("contact_aging")) == model("contact_aging")
    assert not model("contact_aging").turns
    assert model("friction_patch").turns
