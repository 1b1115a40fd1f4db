"""Fitted numbers as results state them."""

from __future__ import annotations

from station.diagnosis.inference.fit import Fit
from station.diagnosis.result import Value
from station.physics.model import Term


def values_of(fitted: Fit, term: Term) -> dict[str, Value]:
    """Returns every number of a term by its name; the standard error of one that is not free is nan."""
    return {
        parameter.name: Value(
            value=term.values[parameter.name],
            sd=fitted.sd(term.effect.id, parameter.name),
            unit=parameter.unit,
            at_bound=fitted.at_bound(term.effect.id, parameter.name),
        )
        for parameter in term.effect.parameters
    }
