"""Terms are compared with what could stand in their places in the order of what the model loses without them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

from station.diagnosis.likelihood.systematic import allowing_for
from station.diagnosis.search.candidates import Candidate
from station.diagnosis.search.coinciding import Coinciding
from station.diagnosis.search.comparison import to_fit, weakest_first
from station.physics.catalogue import catalogue
from station.physics.effect import Effect
from station.physics.model import Model, Term

LOST = {"camera_sag": 5000.0, "wear": 40.0, "stribeck": 300.0}
"""The nats that a model loses without each effect."""


@dataclass
class Fitter:
    """A fitter that knows what each model loses, and keeps what it was asked for."""

    asked: list[list[str]] = field(default_factory=list[list[str]])

    def refit(self, start: Model, effects: Sequence[Effect], noise: object) -> object:
        """Returns a fit with the likelihood of these effects."""
        del start, noise
        self.asked.append([effect.id for effect in effects])
        return SimpleNamespace(log_likelihood=sum(LOST[effect.id] for effect in effects))


def fitted(*names: str) -> Any:
    model = allowing_for(Model(mu_s=0.4), [catalogue()["backlash"]])
    for name in names:
        effect = catalogue()[name]
        values = {one.name: one.neutral + (0.0 if one.is_shape else one.typical) for one in effect.parameters}
        model = model.with_term(Term(effect, values))
    return SimpleNamespace(model=model, noise=None)


def test_the_weakest_comes_first() -> None:
    found = weakest_first(cast("Any", Fitter()), fitted(*LOST))
    assert [effect.id for effect, _ in found] == ["wear", "stribeck", "camera_sag"]
    assert [sum(LOST.values()) - left.log_likelihood for _, left in found] == [40.0, 300.0, 5000.0]


def test_each_term_is_taken_out_once() -> None:
    """The fit for the order is the one that the comparison begins from; it was made twice."""
    fitter = Fitter()
    weakest_first(cast("Any", fitter), fitted(*LOST))
    assert len(fitter.asked) == len(LOST)


def candidate(name: str, twice_gain: float) -> Candidate:
    effect = catalogue()[name]
    return Candidate((effect,), (), None, twice_gain, 1, 0.0, twice_gain, 0.1)


def test_what_promises_nothing_is_not_fitted_in_a_term_s_place() -> None:
    """The term itself is, whatever its score says."""
    ranked = [candidate("viscous", 0.0), candidate("stribeck", 1.0), candidate("wear", 12.0)]
    fitter = cast("Any", SimpleNamespace(coinciding=Coinciding()))
    assert [one.key for one in to_fit(fitter, ranked, catalogue()["stribeck"])] == [("stribeck",), ("wear",)]
