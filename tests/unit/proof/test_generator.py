"""Which generator makes a tier, and that every tier has one."""

import pytest

from shared.errors import UserError
from tests.concealed.cases import TIERS as INDEPENDENT_TIERS
from tests.frames.cases import TIERS as THROUGH_TIERS
from tests.proof.generator import INDEPENDENT, THROUGH_EVERYTHING, module_of, require_generator
from tests.proof.protocol import FULL, tiers_of


def test_every_tier_of_the_protocol_is_made_by_the_generator_that_has_it():
    made = {INDEPENDENT: INDEPENDENT_TIERS, THROUGH_EVERYTHING: THROUGH_TIERS}
    for tier in FULL:
        require_generator(module_of(tier))
        assert tier in made[module_of(tier)]
    assert set(FULL) == {*INDEPENDENT_TIERS, *THROUGH_TIERS}


def test_the_tiers_through_everything_can_be_asked_for():
    assert tiers_of("frames,twin_null", None, quick=True) == {"twin_null": 2, "frames": 2}
    assert tiers_of(None, None, quick=False) == dict(FULL)


def test_a_generator_that_is_not_there_is_named():
    with pytest.raises(UserError, match="needs a whole checkout"):
        require_generator("tests.nothing_of_that_name")
