"""The posterior tells how much is believed of each name, and which names make a class."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from station.diagnosis import thresholds
from station.diagnosis.search.comparison import Comparison
from station.diagnosis.search.posterior import posteriors_of
from station.diagnosis.search.search import Search


def _comparison(*odds: tuple[str, float], gain: float = 0.0) -> Comparison:
    """Returns what could fill a place: ids with twice the log of their odds, the first with a gain."""
    candidates: Any = tuple(
        SimpleNamespace(
            ids=(name,), twice_log_odds=each, twice_gain=gain, unexpected=False, effects=(SimpleNamespace(id=name),)
        )
        for name, each in odds
    )
    return Comparison(cast("Any", None), candidates)


def _found(
    compared: dict[str, Comparison], *, places: tuple[float, ...] = (), global_p: float = 1e-6, top: float = 50.0
) -> Search:
    stage = SimpleNamespace(candidates=(SimpleNamespace(twice_log_odds=top),), places=(), global_p=global_p)
    found: Any = SimpleNamespace(
        compared=compared, stages=(stage,), places=tuple(SimpleNamespace(twice_log_odds=odds) for odds in places)
    )
    return cast("Search", found)


def test_a_name_that_is_far_ahead_stands_alone() -> None:
    believed = posteriors_of(_found({"wear": _comparison(("wear", 40.0), ("adhesion", 10.0))}))
    assert believed.classes["wear"] == ("wear",)
    assert believed.effects["wear"] == pytest.approx(1.0, abs=1e-5)


def test_names_that_are_about_alike_make_a_class() -> None:
    believed = posteriors_of(_found({"wear": _comparison(("wear", 40.0), ("adhesion", 38.0), ("stribeck", 10.0))}))
    assert believed.classes["wear"] == ("wear", "adhesion")
    assert believed.effects["wear"] == pytest.approx(1.0, abs=1e-5)


def test_the_stronger_a_law_the_less_its_lead_counts() -> None:
    odds = (("wear", 40.0), ("adhesion", 30.0))
    weak, strong = _comparison(*odds, gain=10.0), _comparison(*odds, gain=10.0 * thresholds.KNOWN_TO)
    assert weak.class_of("wear") == ("wear",)
    assert strong.class_of("wear") == ("wear", "adhesion")


def test_a_place_is_believed_by_its_odds() -> None:
    assert posteriors_of(_found({}, places=(0.0, 40.0))).places == pytest.approx([0.5, 1.0], abs=1e-5)


@pytest.mark.parametrize("global_p", [1e-6, 0.01, 0.5])
def test_the_sessions_own_null_says_how_likely_nothing_is(global_p: float) -> None:
    odds = global_p / thresholds.NOMINAL
    assert posteriors_of(_found({}, global_p=global_p, top=0.0)).none == pytest.approx(odds / (1.0 + odds))
