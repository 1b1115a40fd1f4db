"""The score of a fitted model on sessions that are drawn from itself; no model of this recording could expect more.

The noise that a model is scored with is bounded from below: by what a channel is trusted to, and by Student's shapes
that rows only resemble. Where the recording's rows scatter less, so must those of a session that is drawn, or the
recording would score above its own ceiling: a session of 60 runs has 2.6 nat a run of that in the marks' places alone,
with a right model as with none, which is half of what a strong effect gains.
"""

from __future__ import annotations

import numpy as np
from scipy.special import betaln, digamma

from station.diagnosis import thresholds
from station.diagnosis.inference.fit import Fit
from station.diagnosis.inference.noise_of import shaking_of
from station.diagnosis.likelihood.feedback import owed
from station.diagnosis.likelihood.slopes import decays, plain_decays
from station.diagnosis.likelihood.student import log_density
from station.diagnosis.likelihood.whitening import Whitening
from station.diagnosis.observations.evidence import Evidence
from station.physics.contact import Array


def expected_log_run(evidence: Evidence, fitted: Fit) -> Array:
    """Returns each run's (runs,) expected log density, nat, if the fitted model is true, with its share of the prior.

    Whitened components are independent, so it is minus the sum of their entropies less the log volume that whitening
    takes, and more where a channel's rows scatter less than its noise. A run without a slide is assumed to be one in
    every session: its limit keeps the log probability that it has.
    """
    whitening = Whitening(evidence, fitted.noise, shaking=shaking_of(evidence, fitted.model))
    scored = log_density(fitted.white, whitening.tail, whitening.limit)
    expected = -entropy(whitening.tail)
    expected += _calmer(evidence, whitening, scored - expected)[whitening.channel]
    each = np.where(whitening.limit, scored, expected)
    each = each + owed(whitening, decays(evidence, fitted.model), plain_decays(evidence))
    found = np.bincount(whitening.run, each, evidence.runs) - whitening.log_scale
    return found + fitted.log_prior / evidence.runs


def _calmer(evidence: Evidence, whitening: Whitening, surplus: Array) -> Array:
    """Returns the score (channels,) of each channel's rows beyond what is expected, at least 0: they scatter less.

    `surplus` (rows,) is that of each row. It is read from the runs that were fitted; a channel whose rows score less
    than expected has what the model lacks, and its ceiling stays.
    """
    known = ~whitening.limit & evidence.counted[whitening.run]
    count = np.bincount(whitening.channel[known], minlength=len(evidence.channels))
    total = np.bincount(whitening.channel[known], surplus[known], len(evidence.channels))
    return np.maximum(total / np.maximum(count, 1), 0.0)


def entropy(tail: Array) -> Array:
    """Returns the differential entropy (n,), nat, of Student's t with `tail` (n,) degrees of freedom.

    From GAUSSIAN on it is that of a Gaussian.

    (ν + 1) / 2 (ψ((ν + 1) / 2) − ψ(ν / 2)) + ln(√ν B(ν / 2, 1 / 2)): Lazo & Rathie 1978, IEEE Trans. Inf. Theory 24,
    120.
    """
    student = 0.5 * (tail + 1.0) * (digamma(0.5 * (tail + 1.0)) - digamma(0.5 * tail))
    student = student + 0.5 * np.log(tail) + betaln(0.5 * tail, 0.5)
    return np.where(tail >= thresholds.GAUSSIAN, 0.5 * np.log(2.0 * np.pi * np.e), student)
