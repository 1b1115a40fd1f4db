"""Smooth terms in words and in one number: on what friction depends that has no name, and by how much."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from station.diagnosis.inference.fit import Fit
from station.diagnosis.likelihood.systematic import less
from station.diagnosis.observations.covariates import TITLES
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.result import Combination, rounded
from station.diagnosis.search.excused import between
from station.diagnosis.search.smooth import covariate_of
from station.physics.contact import Array
from station.physics.effect import Effect
from station.physics.model import Model, Term
from station.physics.smooth import PushAside, is_smooth

UNIT = 1e-3
"""A coefficient so small changes friction in proportion to it."""


def depends_on(effect: Effect) -> str:
    """Returns the quantity, in words, on which a smooth term lets friction depend."""
    covariate = covariate_of(effect)
    return TITLES.get(covariate, covariate)


def smooth_in_words(evidence: Evidence, model: Model, term: Term, *further: Term) -> str:
    """Returns a smooth term in words: what friction depends on, and by how much it changes in the recorded runs.

    Terms that depend `further` on the same are counted in.
    """
    if isinstance(term.effect, PushAside):
        (size,) = term.values.values()
        side = "left" if size > 0 else "right"
        swerve = f"sliding blocks swerve to the {side} of their way by {rounded(abs(size), 2)} m/s²"
        return f"something outside the catalogue: {swerve}"
    apart = between(evidence, less(model, *(one.effect.id for one in (term, *further))), model)
    change = 2 * float(np.sqrt(np.mean(apart**2)))
    return (
        f"something outside the catalogue: friction changes by about {rounded(100 * change, 2)} % "
        f"with the {depends_on(term.effect)}"
    )


def change(evidence: Evidence, fitted: Fit, term: Term, *, like: Term | None = None) -> Combination | None:
    """Returns the change of friction by a smooth term with its standard error.

    It is None for a named effect. Of a push aside it is the push.

    It is twice the root mean square over the recorded rows, and of a term in another recording what it has of the
    change that the term `like` makes in this one: 0 if the two are alike in nothing.
    """
    if not is_smooth(term.effect):
        return None
    free, covariance = fitted.of_effect(term.effect.id)
    if isinstance(term.effect, PushAside):
        value, sd = term.values[free[0].name], float(np.sqrt(max(covariance[0, 0], 0.0)))
        return Combination(
            expression="push of sliding blocks to the left of their way", value=value, sd=sd, unit="m/s²"
        )
    weights = _weights(evidence, fitted.model, like or term)
    return Combination(
        expression=f"change of friction with the {depends_on(term.effect)}",
        value=float(weights @ [term.values[one.name] for one in free]),
        sd=float(np.sqrt(max(weights @ covariance @ weights, 0.0))),
        unit="1",
    )


def change_of(evidence: Evidence, fitted: Fit, terms: Sequence[Term]) -> Combination:
    """Returns the change of friction by smooth terms of one covariate together, with its standard error."""
    ids = [term.effect.id for term in terms]
    free, covariance = fitted.of_effects(ids)
    without, values = less(fitted.model, *ids), {term.effect.id: term.values for term in terms}
    units, size = list[Term](), list[float]()
    for number in free:
        if number.effect is not None and number.parameter is not None:
            units.append(Term(number.effect, {**number.effect.neutral(), number.parameter.name: UNIT}))
            size.append(values[number.effect.id][number.parameter.name])
    weights = _weights_of(evidence, without, units, np.array(size))
    return Combination(
        expression=f"change of friction with the {depends_on(terms[0].effect)}",
        value=float(weights @ size),
        sd=float(np.sqrt(max(weights @ covariance @ weights, 0.0))),
        unit="1",
    )


def _weights(evidence: Evidence, model: Model, term: Term) -> Array:
    """Returns the weights (k,) of a term's coefficients in the change that it makes."""
    without = less(model, term.effect.id)
    names = [one.name for one in term.effect.parameters]
    units = [Term(term.effect, {**term.effect.neutral(), name: UNIT}) for name in names]
    return _weights_of(evidence, without, units, np.array([term.values[name] for name in names]))


def _weights_of(evidence: Evidence, without: Model, units: Sequence[Term], size: Array) -> Array:
    """Returns the weights (k,) of coefficients of `size` (k,), no unit, in the change that they make together."""
    basis = np.column_stack([between(evidence, without, without.with_term(one)) / UNIT for one in units])
    made = basis @ size
    return np.asarray(2.0 * basis.T @ made / (np.sqrt(len(made)) * max(float(np.linalg.norm(made)), 1e-12)))
