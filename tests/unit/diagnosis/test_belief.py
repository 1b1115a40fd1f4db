"""How much is believed of what is found beside other laws."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from station.diagnosis.search.belief import beliefs
from station.diagnosis.search.search import Search
from station.physics.catalogue import catalogue

SERIES, LAW = "friction_patch", "stribeck"
BOTH = frozenset({"onset", "along"})


def _alone(name: str) -> tuple[str, ...]:
    return (name,)


def _found(stages: list[str], *, gains: dict[str, float], channels: dict[str, frozenset[str]] | None = None) -> Search:
    """What a search found stage by stage, each term without a rival for its place."""
    effects = catalogue()
    compared = {
        name: SimpleNamespace(
            candidates=(SimpleNamespace(effects=(effects[name],), twice_gain=gain),),
            shares=lambda name=name: {name: 1.0, "none": 0.0},
            class_of=_alone,
        )
        for name, gain in gains.items()
    }
    looks = [
        SimpleNamespace(chosen=SimpleNamespace(key=(name,)), candidates=(), places=(), global_p=1e-6) for name in stages
    ]
    found: Any = SimpleNamespace(
        found=tuple(effects[name] for name in gains),
        compared=compared,
        channels=channels or dict.fromkeys(gains, BOTH),
        stages=tuple(looks),
        places=(),
    )
    return cast("Search", found)


def test_what_a_series_leaves_is_doubted_by_its_share_of_the_gain() -> None:
    believed = beliefs(_found([SERIES, LAW], gains={SERIES: 100.0, LAW: 50.0})).effects
    assert believed[LAW] == pytest.approx(0.5)
    assert believed[SERIES] == pytest.approx(1.0)


def test_a_law_that_was_found_before_the_series_is_not_what_it_leaves() -> None:
    believed = beliefs(_found([LAW, SERIES], gains={SERIES: 100.0, LAW: 50.0})).effects
    assert believed[LAW] == pytest.approx(1.0)


def test_a_series_leaves_nothing_where_it_does_not_act() -> None:
    channels = {SERIES: BOTH, LAW: frozenset({"rest"})}
    believed = beliefs(_found([SERIES, LAW], gains={SERIES: 100.0, LAW: 50.0}, channels=channels)).effects
    assert believed[LAW] == pytest.approx(1.0)


def test_beside_an_exact_law_another_is_believed() -> None:
    believed = beliefs(_found(["kinetic_drop", LAW], gains={"kinetic_drop": 1000.0, LAW: 50.0})).effects
    assert believed[LAW] == pytest.approx(1.0)


def test_what_stands_out_where_a_law_acts_is_doubted_by_its_share_of_the_laws_gain() -> None:
    found: Any = _found([LAW], gains={LAW: 1000.0}, channels={LAW: frozenset({"rest"})})
    for channel, believed in (("rest", 0.25), ("turn", 1.0)):
        place = SimpleNamespace(
            place=SimpleNamespace(channel=SimpleNamespace(name=channel)), odds=40.0, twice_gain=50.0
        )
        found.places = (place,)
        assert beliefs(found).places == pytest.approx([believed], abs=0.01)
