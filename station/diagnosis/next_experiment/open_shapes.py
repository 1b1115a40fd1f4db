"""Rivals whose law has a shape that the recording left open: they are one for each value from which it is sought.

Where all runs had one mass, no recording says if a drag grows with the load: a session with other masses may show
either. The size follows the shape, so that the recording would have been the same.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from station.diagnosis.likelihood.slopes import residuals
from station.diagnosis.likelihood.whitening import stack
from station.diagnosis.next_experiment.outlook import Rival
from station.diagnosis.observations.evidence import Evidence
from station.physics.contact import Array
from station.physics.model import Model, Term

ROUNDS = 4
"""Residuals are nearly linear in a size: each round leaves some hundredths of the difference."""


def open_shapes(evidence: Evidence, beside: Model, rival: Rival) -> list[Rival]:
    """Returns the rival with each start of the shapes that are idle in the evidence, which share its weight evenly."""
    contact = evidence.contact()
    idle = rival.term.effect.idle(contact) if contact is not None else frozenset[str]()
    shapes = [one for one in rival.term.effect.parameters if one.is_shape and one.name in idle]
    if not shapes:
        return [rival]
    wanted = _change(evidence, beside, rival.term)
    values = itertools.product(*(one.starts for one in shapes))
    terms = [
        rival.term.with_values(**{one.name: value for one, value in zip(shapes, each, strict=True)}) for each in values
    ]
    found = [one for term in terms for one in _matched(evidence, beside, term, wanted)] or [rival.term]
    return [replace(rival, term=term, weight=rival.weight / len(found)) for term in found]


def _matched(evidence: Evidence, beside: Model, term: Term, wanted: Array) -> Iterator[Term]:
    """Yields the term whose sizes are scaled to change the evidence as is wanted.

    It yields nothing where the term changes none of it.
    """
    for _ in range(ROUNDS):
        change = _change(evidence, beside, term)
        power = float(change @ change)
        if power == 0.0:
            return
        term = _scaled(term, float(change @ wanted) / power)
    yield term


def _scaled(term: Term, times: float) -> Term:
    sizes = (one for one in term.effect.parameters if not one.is_shape)
    return term.with_values(
        **{one.name: one.clipped(one.neutral + times * (term.values[one.name] - one.neutral)) for one in sizes}
    )


def _change(evidence: Evidence, beside: Model, term: Term) -> Array:
    """Returns the change of the residuals of all rows (n,) by the term."""
    one, other = (stack(evidence, residuals(evidence, model)) for model in (beside.with_term(term), beside))
    return np.asarray(one - other)
