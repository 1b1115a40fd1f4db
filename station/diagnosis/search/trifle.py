"""Trifles: what changes no row of any channel by more than the channel is trusted to is told of by nobody.

A measurement has errors that all runs share, so that more runs do not make it surer (`Channel.trusted`).
"""

from __future__ import annotations

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.inference.columns import Scores
from station.diagnosis.inference.fit import Fit
from station.diagnosis.inference.gain import estimate
from station.diagnosis.likelihood.systematic import is_nuisance
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.search.places import Place
from station.physics.model import Model


def is_trifle(evidence: Evidence, without: Fit, fitted: Fit) -> bool:
    """True if a fit differs from one without some effect by less than any channel is trusted to.

    What is allowed for may stand in for the effect as far as it is believed to, and not farther.
    """
    model = _believable(without.model)
    for channel in evidence.channels:
        apart = channel.residual(fitted.model) - channel.residual(model)
        if len(apart) and float(np.abs(apart).max()) > channel.trusted:
            return False
    return True


def _believable(model: Model) -> Model:
    """The model with what is only allowed for within so many of its standard deviations as are believed."""
    for term in model.terms:
        if is_nuisance(term.effect):
            kept = {
                one.name: min(max(term.values[one.name], one.neutral - reach), one.neutral + reach)
                for one in term.effect.parameters
                for reach in (thresholds.BELIEVED * one.typical,)
            }
            model = model.with_term(term.with_values(**kept))
    return model


def is_trifling_place(scored: Scores, place: Place) -> bool:
    """True if what stands out at a place is less than its channel is trusted to."""
    apart = place.basis @ estimate(scored, place.columns)
    return float(np.abs(apart).max(initial=0.0)) < place.channel.trusted
