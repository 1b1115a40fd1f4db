from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from station.export.materials import RULES, Rule, combine, each_material, shared_materials
from station.export.measured import MeasuredPair
from tests.unit.export.pairs import STEEL_ON_WOOD


def test_the_rules_are_those_of_the_engines():
    assert {rule: round(combine(rule, 0.3, 0.6), 4) for rule in RULES} == {
        "max": 0.6,
        "min": 0.3,
        "average": 0.45,
        "harmonic": 0.4,
        "product": 0.18,
    }


@given(mu=st.floats(0.01, 3.0))
@pytest.mark.parametrize("rule", RULES)
def test_a_pair_is_read_back(rule: Rule, mu: float):
    each = each_material(rule, mu)
    assert combine(rule, each, each) == pytest.approx(mu, rel=1e-12)


def pair(object: str, plate: str, mu: float) -> MeasuredPair:
    return replace(STEEL_ON_WOOD, object=object, plate=plate, mu_1=mu, mu_2=mu)


@pytest.mark.parametrize("rule", RULES)
def test_shared_materials_are_exact_where_the_rule_allows_it(rule: Rule):
    planted = {"steel": 0.3, "wood": 0.6, "felt": 0.45}
    pairs = [
        pair(a, b, combine(rule, planted[a], planted[b]))
        for a, b in (("steel", "wood"), ("wood", "felt"), ("felt", "felt"), ("steel", "steel"))
    ]
    shared = shared_materials(rule, pairs)
    assert shared.misread_rad < 1e-9
    for each in pairs:
        assert combine(rule, shared.mu[each.object], shared.mu[each.plate]) == pytest.approx(each.mu)


@pytest.mark.parametrize("rule", RULES)
def test_what_no_materials_can_say_is_owned_up_to(rule: Rule):
    # Two materials and three pairs, the mixed one lower than both and then higher than both.
    for mixed in (0.2, 0.6):
        pairs = [pair("steel", "steel", 0.35), pair("wood", "wood", 0.4), pair("steel", "wood", mixed)]
        shared = shared_materials(rule, pairs)
        worst = next(each for each in pairs if each.name == shared.worst)
        read = combine(rule, shared.mu[worst.object], shared.mu[worst.plate])
        assert shared.misread_rad == pytest.approx(abs(math.atan(read) - math.atan(worst.mu)))
        assert shared.misread_rad > math.radians(1)
