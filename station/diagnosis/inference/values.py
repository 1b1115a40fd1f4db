"""Fitted numbers as results state them, with standard errors that include a law's own inexactness."""

from __future__ import annotations

import math

from station.diagnosis import thresholds
from station.diagnosis.inference.fit import Fit
from station.diagnosis.result import Value
from station.physics.model import Term


def values_of(fitted: Fit, term: Term) -> dict[str, Value]:
    """Every number of a term by its name; the standard error of one that is not free is nan."""
    return {
        parameter.name: Value(
            value=term.values[parameter.name],
            sd=math.hypot(fitted.sd(term.effect.id, parameter.name), inexact(term, parameter.name)),
            unit=parameter.unit,
            at_bound=fitted.at_bound(term.effect.id, parameter.name),
        )
        for parameter in term.effect.parameters
    }


def inexact(term: Term, name: str) -> float:
    """The standard error of a number, in its unit, that remains however precise the recording is."""
    return thresholds.EXACT * _size(term, name)


def _size(term: Term, name: str) -> float:
    """The size of a number, or of the vector that it is a component of.

    Components have the same unit, typical size and bounds, and their bounds are symmetric about 0.
    """
    kinds = {p.name: (p.unit, p.low, p.high, p.typical) for p in term.effect.parameters}
    like = [other for other, kind in kinds.items() if kind == kinds[name] and kind[1] == -kind[2]] or [name]
    return math.hypot(*(term.values[other] for other in like))
