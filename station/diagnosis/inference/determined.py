"""Identifiable combinations of an effect's numbers that trade off and are not identifiable one by one.

The size and the shape of a speed law, for example, trade off along a line: neither is known alone, but the slope of
friction over the recorded speeds is known to a per cent. An effect offers such quantities (`Effect.derived`); for an
effect that offers none the best known linear combination of its numbers is given.

Where no block was seen to let go, static friction itself is extrapolated, and trades off with a speed law's numbers.
What is relative to it is then told as a coefficient of friction, which the slides determine: tossed cubes have a slope
of 0.0223 ± 0.0008 an e-fold, and 0.20 ± 0.06 of a static friction that nobody saw (`pytest -m benchmark -s
tests/benchmarks/test_toss_paths.py` prints the former).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from station.diagnosis.inference.best_known import INFLATED, best_known_line, inflation
from station.diagnosis.inference.fit import Fit
from station.diagnosis.inference.parameters import moved
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.result import Combination
from station.physics.contact import Array, Contact
from station.physics.effect import Values
from station.physics.model import Model, Term
from station.physics.parameter import Parameter
from station.physics.speed_slope import OF_STATIC

STEP = 1e-3
"""The step of the derived quantities' slopes, in typical sizes of a parameter."""


def determined(evidence: Evidence, fitted: Fit, term: Term) -> tuple[Combination, ...]:
    """Returns the combinations of a term's numbers that are identifiable; empty where each number stands for itself."""
    free, covariance = fitted.of_effect(term.effect.id)
    held = [fitted.at_bound(term.effect.id, one.name) for one in free]
    entangled = len(free) > 1 and (term.effect.is_series or _entangled(covariance, held))
    contact = _contact(evidence)
    offered = {} if contact is None else term.effect.derived(contact, term.values)
    if entangled and (contact is None or not offered):
        return best_known_line(free, covariance, term.values, held)
    unseen = [name for name, (_, unit) in offered.items() if unit == OF_STATIC and evidence.onsets is None]
    found = [_coefficient(evidence, fitted, term, name) for name in unseen]
    if not entangled or contact is None:
        return tuple(found)
    slopes = _slopes(lambda values: term.effect.derived(contact, values), term.values, free)
    found += [
        Combination(
            expression=expression,
            value=value,
            sd=float(np.sqrt(max(slopes[expression] @ covariance @ slopes[expression], 0.0))),
            unit="1" if unit == OF_STATIC else unit,
        )
        for expression, (value, unit) in offered.items()
        if expression not in unseen
    ]
    return tuple(found)


def _coefficient(evidence: Evidence, fitted: Fit, term: Term, expression: str) -> Combination:
    """Returns a quantity offered relative to static friction, as a coefficient of friction at the recorded states.

    The level is that of all slides, which every free number moves as much as it moves their mean residual.
    """
    along, contact = evidence.slides, _contact(evidence)
    assert along is not None
    assert contact is not None
    level = float(np.mean(fitted.model.friction(contact)) * np.exp(np.mean(along.residual(fitted.model))))

    def value(model: Model) -> float:
        own = next(one for one in model.terms if one.effect.id == term.effect.id)
        relative = own.effect.derived(contact, own.values)[expression][0]
        typical = float(np.mean(own.effect.friction(contact, own.values)))
        return level * float(np.exp(-np.mean(along.residual(model)))) * relative / typical

    steps = [STEP if one.high > at + STEP else -STEP for one, at in zip(fitted.free, fitted.vector, strict=True)]
    middle = value(fitted.model)
    moves = [value(moved(fitted.model, one, step)) for one, step in zip(fitted.free, steps, strict=True)]
    slopes = (np.array(moves) - middle) / np.array(steps)
    return Combination(
        expression=f"{expression}, as a coefficient",
        value=middle,
        sd=float(np.sqrt(max(slopes @ fitted.covariance @ slopes, 0.0))),
        unit="1",
    )


def _entangled(covariance: Array, at_bound: list[bool]) -> bool:
    """Returns true if a number is at its bound, or its standard error falls by INFLATED when the others are given."""
    return any(at_bound) or bool(np.any(inflation(covariance) > INFLATED))


def _slopes(
    derived: Callable[[Values], Mapping[str, tuple[float, str]]], values: Values, free: tuple[Parameter, ...]
) -> dict[str, Array]:
    """Returns slopes (k,) of each derived quantity by the free numbers; a number at its upper bound is moved down."""
    middle, columns = derived(values), list[dict[str, float]]()
    for one in free:
        step = STEP * one.typical * (1.0 if values[one.name] + STEP * one.typical <= one.high else -1.0)
        moved = derived({**values, one.name: values[one.name] + step})
        columns.append({name: (moved[name][0] - value) / step for name, (value, _) in middle.items()})
    return {name: np.array([column[name] for column in columns]) for name in middle}


def _contact(evidence: Evidence) -> Contact | None:
    """Returns the recorded states: those of the slides, or else of the onsets; None without either."""
    slides = evidence.slides
    return evidence.contact() if slides is None else slides.contact
