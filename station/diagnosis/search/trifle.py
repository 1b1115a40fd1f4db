"""Negligible effects: one that changes no row by more than its channel's systematic floor is claimed by nobody.

A measurement has errors that all runs share, and more runs do not make it surer (`Channel.trusted`).
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
    """Returns true if the effect changes every predicted measurement by less than that channel's systematic floor.

    The nuisances of the fit without it may stand in for the effect up to BELIEVED of their standard deviations.
    """
    model = _with_clipped_nuisances(without.model)
    for channel in evidence.channels:
        apart = channel.residual(fitted.model) - channel.residual(model)
        if len(apart) and float(np.abs(apart).max()) > channel.trusted:
            return False
    return True


def _with_clipped_nuisances(model: Model) -> Model:
    """Returns the model with its nuisances clipped to BELIEVED of their standard deviations."""
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
    """Returns true if a place's smooth part stays below its channel's systematic floor."""
    apart = place.basis @ estimate(scored, place.columns)
    return float(np.abs(apart).max(initial=0.0)) < place.channel.trusted
