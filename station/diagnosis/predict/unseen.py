"""The log density of runs that a fit has not seen, where the noise's tails are known from the fitted runs alone.

Thirty Gaussian residuals do not exclude that the next one is an outlier. Under the likeliest tail it would count for
hundreds of nats, and by its share of them every other run's gain would be lost (a session of 60 runs with one onset 26
standard deviations off: -224 of -108 nat). So each run's density is the mean over TAILS, weighted by what the fitted
runs say of them: the posterior predictive density under a flat prior (Gelman et al. 2013, Bayesian Data Analysis, 1.3).
"""

from __future__ import annotations

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.inference.fit import Fit
from station.diagnosis.inference.noise_of import shaking_of
from station.diagnosis.likelihood.feedback import owed
from station.diagnosis.likelihood.noise import TAILS
from station.diagnosis.likelihood.slopes import decays, plain_decays
from station.diagnosis.likelihood.student import log_density, scale_of
from station.diagnosis.likelihood.whitening import Whitening
from station.diagnosis.observations.evidence import Evidence
from station.physics.contact import Array, Bools


def unseen_log_run(evidence: Evidence, fitted: Fit) -> Array:
    """Returns the log density (runs,), nat, of each run; that of the runs which were fitted has no meaning."""
    whitening = Whitening(evidence, fitted.noise, shaking=shaking_of(evidence, fitted.model))
    known = evidence.counted[whitening.run] & ~whitening.limit
    to_motion = owed(whitening, decays(evidence, fitted.model), plain_decays(evidence))
    found = np.bincount(whitening.run, to_motion, evidence.runs) - whitening.log_scale
    for index, channel in enumerate(evidence.channels):
        mine = whitening.channel == index
        # The means of a continuous record have no tail (see `fit.with_tails`).
        tails = (thresholds.GAUSSIAN,) if evidence.is_record(channel) else TAILS
        density = _densities(fitted.white[mine], known[mine], whitening.limit[mine], tails)
        of_runs = np.array([np.bincount(whitening.run[mine], each, evidence.runs) for each in density])
        weight = density[:, known[mine]].sum(axis=1)
        found += np.logaddexp.reduce(weight[:, None] - np.logaddexp.reduce(weight) + of_runs, axis=0)
    return found


def _densities(white: Array, known: Bools, limit: Bools, tails: tuple[float, ...]) -> Array:
    """Returns the log density (tails, n) of whitened components (n,) by tail, at the scale that fits the known ones."""
    scales = np.array([scale_of(white[known], tail) for tail in tails])[:, None]
    each = [log_density(one, np.array(tail), limit) for one, tail in zip(white / scales, tails, strict=True)]
    return np.array(each) - np.where(limit, 0.0, np.log(scales))
