"""How much is believed of what is found beside other laws."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from station.diagnosis.search.belief import beliefs
from station.diagnosis.search.search import Search
from station.diagnosis.thresholds import KNOWN_TO
from station.physics.catalogue import catalogue

LAW, OTHER = "stribeck", "friction_patch"
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


def test_a_gain_as_large_as_the_misfit_of_the_law_beside_it_is_half_believed() -> None:
    believed = beliefs(_found([LAW, OTHER], gains={LAW: 50.0 * KNOWN_TO, OTHER: 50.0})).effects
    assert believed[OTHER] == pytest.approx(0.5)
    assert believed[LAW] > 0.99


def test_a_law_leaves_nothing_where_it_does_not_act() -> None:
    channels = {LAW: BOTH, OTHER: frozenset({"rest"})}
    believed = beliefs(_found([LAW, OTHER], gains={LAW: 50.0 * KNOWN_TO, OTHER: 50.0}, channels=channels)).effects
    assert believed[OTHER] == pytest.approx(1.0)


def test_what_stands_out_where_a_law_acts_is_doubted_by_its_misfit() -> None:
    found: Any = _found([LAW], gains={LAW: 150.0 * KNOWN_TO}, channels={LAW: frozenset({"rest"})})
    for channel, believed in (("rest", 0.25), ("turn", 1.0)):
        place = SimpleNamespace(
            place=SimpleNamespace(channel=SimpleNamespace(name=channel)), odds=40.0, twice_gain=50.0
        )
        found.places = (place,)
        assert beliefs(found).places == pytest.approx([believed], abs=0.01)
