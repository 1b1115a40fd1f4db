"""Effects named on the command line."""

from __future__ import annotations

import math

import pytest

from shared.errors import UserError
from shared.messages import Sample
from station.app.planting import plain_model, plant
from station.physics.catalogue import catalogue
from station.physics.model import Model

KNOWN = catalogue()
PLAIN = Model(mu_s=0.4, scatter=0.1)


def test_one_number_plants_the_first_parameter_and_the_others_are_at_their_null() -> None:
    (term,) = plant(["kinetic_drop=0.3"], PLAIN, KNOWN).terms
    assert (term.effect.id, term.values) == ("kinetic_drop", {"drop": 0.3})
    (term,) = plant(["stribeck=0.3"], PLAIN, KNOWN).terms
    assert term.values == {**KNOWN["stribeck"].neutral(), "drop": 0.3}


def test_further_parameters_are_named_and_friction_stays() -> None:
    model = plant(["stribeck=0.3", "stribeck.speed_m_s=0.05", "wear=0.1"], PLAIN, KNOWN)
    values = {term.effect.id: term.values for term in model.terms}
    assert values["stribeck"]["speed_m_s"] == 0.05
    assert values["wear"]["fall"] == 0.1
    assert (model.mu_s, model.scatter) == (0.4, 0.1)


def test_a_model_with_an_effect_is_changed_in_what_is_named_only() -> None:
    model = plant(["stribeck=0.3", "stribeck.speed_m_s=0.05"], PLAIN, KNOWN)
    (term,) = plant(["stribeck=0.2"], model, KNOWN).terms
    assert (term.values["drop"], term.values["speed_m_s"]) == (0.2, 0.05)


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("kinetic_drop", "Expected ID=VALUE"),
        ("=0.3", "Expected ID=VALUE"),
        ("kinetic_drop=much", "Expected a number after kinetic_drop=, got 'much'"),
        ("kinetic_drp=0.3", "did you mean kinetic_drop?"),
        ("zzz=0.3", "`station effects` lists them"),
        ("kinetic_drop=3", "Expected a number from 0 to 0.6 for effects.kinetic_drop.drop, got"),
        ("kinetic_drop=nan", "Expected a number from 0 to 0.6 for effects.kinetic_drop.drop, got"),
        ("kinetic_drop.depth=0.3", "depth"),
        ("stribeck.speed_m_s=0.05", "Expected drop"),
    ],
)
def test_what_cannot_be_planted_is_said(word: str, said: str) -> None:
    with pytest.raises(UserError) as refused:
        plant([word], PLAIN, KNOWN)
    assert said in str(refused.value)


def test_the_friction_as_recorded_is_the_median_of_the_runs_that_slid() -> None:
    slid = [Sample(run=k, onset_angle_rad=math.atan(mu)) for k, mu in enumerate((0.3, 0.4, 0.9))]
    stuck = Sample(run=9, onset_angle_rad=1.2, censored=True)
    assert plain_model([*slid, stuck]).mu_s == pytest.approx(0.4)
    with pytest.raises(UserError, match="--model"):
        plain_model([stuck])
