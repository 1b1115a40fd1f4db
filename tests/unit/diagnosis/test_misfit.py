"""What a law leaves to others by not being nature's."""

import pytest

from station.diagnosis.search.misfit import Gained, is_misfit, superfluous, temperature
from station.diagnosis.thresholds import KNOWN_TO

SLIDE, REST = frozenset({"onset", "along"}), frozenset({"rest"})


@pytest.mark.parametrize(("share", "is_one"), [(0.9, True), (1.1, False)])
def test_a_gain_below_what_the_law_beside_it_leaves_is_its_misfit(share: float, is_one: bool) -> None:
    law = Gained(SLIDE, 100.0 * KNOWN_TO)
    assert is_misfit(Gained(SLIDE, 100.0 * share), [law, Gained(SLIDE, 1.0)]) is is_one


def test_a_law_leaves_nothing_where_it_does_not_act() -> None:
    assert not is_misfit(Gained(REST, 1.0), [Gained(SLIDE, 100.0 * KNOWN_TO)])
    assert not is_misfit(Gained(REST, 1.0), [])


def test_the_smallest_of_a_models_misfits_goes_first() -> None:
    law, more, less = Gained(SLIDE, 100.0 * KNOWN_TO), Gained(SLIDE, 50.0), Gained(SLIDE, 20.0)
    assert superfluous({"law": law, "more": more, "less": less}) == "less"
    assert superfluous({"law": law, "other": Gained(SLIDE, 200.0)}) is None


def test_differences_of_strong_laws_count_less() -> None:
    assert temperature([]) == 1.0
    assert temperature([KNOWN_TO, 3.0 * KNOWN_TO]) == pytest.approx(4.0)
