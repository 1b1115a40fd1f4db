import pytest

from tests.proof.advice import features
from tests.unit.proof.made_up import concealed, said, scored, truth


def advised(plan: str, why: str, *entries: list[str]) -> bool:
    case = truth("confounded", concealed("viscous"), answer="class", next=[*entries])
    return scored(case, said(next_experiment={"plan": plan, "why": why})).advised


def test_a_plan_that_varies_what_is_missing_is_right():
    plan = "# dwell at random\nsamples = 60\n\n[dwell]\nmin_s = 1.0\n"
    assert advised(plan, "dwell at random separates contact_aging from wear", ["dwell"])
    assert not advised(plan, "dwell at random separates contact_aging from wear", ["masses"], ["yaw"])


def test_all_words_of_an_entry_are_needed():
    assert not advised("", "block turned separates a from b", ["yaw", "mounts"])
    assert advised("", "block turned separates a from b; turn the plate in its mount", ["yaw", "mounts"])


def test_no_advice_is_wrong():
    assert features(None) == frozenset()


def test_a_plan_that_the_tool_itself_says_does_not_do_it_counts_by_its_reason():
    assert not advised('[direction]\nmode = "free"\n', "no plan alone separates them: a second mass", ["free"])
    assert advised('[direction]\nmode = "free"\n', "no plan alone separates them: a second mass", ["masses"])


@pytest.mark.parametrize(
    ("reason", "right"), [("All runs have one mass; add a second mass.", True), ("it is too weak", False)]
)
def test_an_absorbed_effect_is_explained_by_what_it_takes(reason: str, right: bool):
    case = truth("absorbed", concealed("adhesion"), answer="untestable", next=[["masses"]])
    assert scored(case, said(untestable=[{"id": "adhesion", "reason": reason}])).explained is right
