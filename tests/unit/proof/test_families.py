"""Every file of the folder is a family with a generator of its own, and the tiers can be asked for."""

import pytest

from shared.errors import UserError
from station.physics.catalogue import catalogue
from tests.concealed.cases import TIERS as OWN_TIERS
from tests.frames.cases import TIERS as FRAMES_TIERS
from tests.proof.families import families
from tests.proof.generator import require_generator
from tests.proof.patch_world.cases import TIERS as PATCH_TIERS
from tests.proof.protocol import tiers_of

FULL = {name: family.full for name, family in families().items()}
QUICK = {name: family.quick for name, family in families().items()}


def asked(names: str | None, cases: int | None = None, *, quick: bool = True) -> dict[str, dict[str, int]]:
    return tiers_of(FULL, QUICK, names=names, cases=cases, is_quick=quick)


def test_the_families_that_are_known_come_first():
    assert list(families())[:3] == ["own", "patch_world", "frames"]


@pytest.mark.parametrize("name", FULL)
def test_a_family_has_a_generator_and_no_tier_in_the_quick_proof_alone(name: str):
    require_generator(families()[name].generator()[0])
    assert QUICK[name].keys() <= FULL[name].keys()
    assert min(FULL[name].values()) > 0


@pytest.mark.parametrize(
    ("name", "tiers"), [("own", OWN_TIERS), ("frames", FRAMES_TIERS), ("patch_world", PATCH_TIERS)]
)
def test_the_tiers_are_those_of_the_generator(name: str, tiers: tuple[str, ...]):
    assert set(FULL[name]) == set(tiers)


@pytest.mark.parametrize("name", FULL)
def test_a_parametrisation_is_of_the_catalogue_and_either_exact_or_not(name: str):
    family = families()[name]
    assert family.maps().keys() <= catalogue().keys()
    assert family.inexact().keys() <= catalogue().keys()
    assert not family.maps().keys() & family.inexact().keys()


def test_tiers_are_asked_for_by_name_in_every_family_that_has_them_or_in_one():
    assert {"own", "patch_world"} <= asked("single:3").keys()
    assert asked("own/single:3,frames") == {"own": {"single": 3}, "frames": {"frames": 2}}
    assert asked("own/null,own/pair:7", 3) == {"own": {"null": 3, "pair": 7}}
    assert asked(None)["own"] == dict(QUICK["own"])
    assert asked(None, quick=False) == {name: dict(tiers) for name, tiers in FULL.items()}


def test_what_cannot_be_asked_for_is_said():
    with pytest.raises(UserError, match="number of cases of 1 or more after the colon"):
        asked("pair:none")
    with pytest.raises(UserError, match="tiers among"):
        asked("nil")
    with pytest.raises(UserError, match="--cases"):
        asked(None, 0)


def test_a_generator_that_is_not_there_is_named():
    with pytest.raises(UserError, match="needs a whole checkout"):
        require_generator("tests.nothing_of_that_name")
