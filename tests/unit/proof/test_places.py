import math
from dataclasses import replace

import pytest

from tests.proof.places import acting_auc, auc, place_auc, place_right
from tests.unit.proof.made_up import claim, concealed, place, said, truth

ODD = tuple(range(1, 21, 2))
CASE = truth("single", concealed("contact_aging"))
AGEING = CASE.effects[0]


def test_area_under_the_curve():
    assert auc([2.0, 3.0], [0.0, 1.0]) == 1.0
    assert auc([0.0], [1.0]) == 0.0
    assert auc([1.0, 1.0], [1.0]) == 0.5
    assert auc([1.0, 3.0], [2.0, 0.0]) == 0.75
    assert math.isnan(auc([], [1.0]))


def test_the_right_place_with_the_right_runs_is_perfect():
    answer = said(located=(place("onset", "dwell", runs=ODD),))
    assert place_auc(answer, AGEING) == 1.0
    assert place_right(answer, AGEING)


def test_a_named_effect_is_scored_by_what_it_says_of_itself():
    """It acts in the slides of five runs and, by less, of five others, and in no onset."""
    acted = {("slide", run): float(run % 3) for run in range(1, 16)} | {("onset", run): 0.0 for run in range(1, 16)}
    effect = replace(AGEING, acted=acted)
    runs = list(range(1, 16))
    slides = {"phase": "slide", "runs": runs, "sizes": [float(run % 3) for run in runs]}
    onsets = {"phase": "onset", "runs": runs, "sizes": [0.1] * 15}
    named = claim("contact_aging") | {"acting": [onsets, slides]}
    assert acting_auc(said(named), effect) == 1.0
    assert acting_auc(said(named | {"acting": [onsets, slides | {"sizes": [1.0] * 15}]}), effect) < 1.0
    assert acting_auc(said(claim("viscous") | {"acting": [slides]}), effect) == 0.5
    assert math.isnan(acting_auc(said(named), AGEING))


def test_silence_is_chance_and_a_wrong_place_is_worse():
    assert place_auc(said(), AGEING) == 0.5
    wrong = said(located=(place("slide", "speed", runs=ODD),))
    assert place_auc(wrong, AGEING) < 0.5
    assert not place_right(wrong, AGEING)


def test_a_surer_wrong_place_beside_the_right_one_costs():
    one = place_auc(said(located=(place("onset", "dwell", runs=ODD),)), AGEING)
    two = place_auc(
        said(located=(place("onset", "dwell", runs=ODD), place("onset", "direction", p=1e-9, runs=ODD))), AGEING
    )
    assert 0.9 < two < one


def test_wrong_runs_at_the_right_place_cost_little_but_something():
    even = tuple(range(2, 21, 2))
    right = place_auc(said(located=(place("onset", "dwell", runs=ODD),)), AGEING)
    wrong = place_auc(said(located=(place("onset", "dwell", runs=even),)), AGEING)
    assert wrong < right


@pytest.mark.parametrize(("phase", "covariate"), [("slide", "speed")])
def test_one_of_several_listed_places_is_enough(phase: str, covariate: str):
    drag = truth("single", concealed("viscous")).effects[0]
    assert place_auc(said(located=(place(phase, covariate, runs=ODD),)), drag) == 1.0


def test_what_the_other_effect_of_a_pair_shows_is_not_held_against_it():
    both = truth("pair", concealed("contact_aging"), concealed("viscous")).effects
    answer = said(located=(place("onset", "dwell", runs=ODD), place("slide", "speed", p=1e-9, runs=ODD)))
    assert place_auc(answer, both[0]) < 1.0
    assert place_auc(answer, both[0], others=both[1:]) == 1.0


RECORDED = replace(
    AGEING,
    where=(),
    acted={("onset", run): 2.0 if run in ODD else 0.1 for run in range(1, 21)}
    | {("slide", run): 0.0 for run in range(1, 21)},
)
"""An effect of which the generator recorded by how much it acted in each phase of each run, and no covariate."""


def test_a_generators_record_is_scored_by_run_and_phase():
    right, wrong = (said(located=(place(phase, "dwell", runs=ODD),)) for phase in ("onset", "slide"))
    assert place_auc(right, RECORDED) == 1.0
    assert place_auc(wrong, RECORDED) < 0.5
    assert place_auc(said(), RECORDED) == 0.5
    assert (place_right(right, RECORDED), place_right(wrong, RECORDED)) == (True, False)


def test_a_place_where_an_effect_shows_is_right_even_if_it_shows_more_elsewhere():
    """Friction that is a tenth lower moves a slide by 20 units and its onset by 2: a tool that lists both is right."""
    both = {("onset", run): 2.0 for run in range(1, 21)} | {("slide", run): 20.0 for run in range(1, 21)}
    acted = replace(RECORDED, acted=both | {("rest", run): 0.0 for run in range(1, 21)})
    runs = tuple(range(1, 21))
    answer = said(located=tuple(place(phase, "dwell", p=1e-9, runs=runs) for phase in ("onset", "slide")))
    assert place_auc(answer, acted) == 1.0


def test_one_run_that_slipped_early_does_not_hide_where_the_others_show_it():
    early = replace(RECORDED, acted={**RECORDED.acted, ("pre-slip", 1): 40.0})
    assert place_auc(said(located=(place("onset", "dwell", runs=ODD),)), early) > 0.9
