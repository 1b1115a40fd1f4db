"""The recorded level of friction: the coefficient at which half of the runs hold on for longer."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.stats import CensoredData, ecdf

from station.diagnosis.inference.fit import Fit
from station.diagnosis.likelihood.systematic import without_nuisances
from station.diagnosis.observations.channel import Channel
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.result import Value
from station.physics.contact import Array, Bools, Contact
from station.physics.model import Model

HALF = 0.5
OF_MEDIAN = math.sqrt(math.pi / 2.0)
"""A median's standard error over a mean's, of Gaussian values."""


def levelled(evidence: Evidence, start: Model) -> Model:
    """Returns the model with mu_s at the recorded level.

    Far from that level the residuals' median would count as scatter, every later noise estimate would stay too large,
    and no effect would show.
    """
    channel = evidence.friction
    if channel is None or not evidence.known(channel).any():
        return start
    counted = evidence.counted[channel.rows.run]
    return replace(start, mu_s=start.mu_s * math.exp(_median(channel.residual(start)[counted], channel, counted)))


def _median(values: Array, channel: Channel, counted: Bools) -> float:
    """Returns the median of values (n,) of the rows that count, some of which are only known to lie beyond their limit.

    It is that of the product-limit estimate (Kaplan & Meier 1958, J. Am. Stat. Assoc. 53, 457). Without the runs that
    never slid the level would come out low, the more the fewer of them slide.
    """
    limit = channel.rows.limit[counted]
    if not limit.any():
        return float(np.median(values))
    beyond = ecdf(CensoredData.right_censored(values, limit)).sf
    half = np.flatnonzero(beyond.probabilities <= HALF)
    return float(beyond.quantiles[half[0] if len(half) else -1])


def as_simulated(evidence: Evidence, fitted: Fit) -> Model:
    """Returns the model for a simulator: without nuisances, and with mu_s at the recorded level.

    With one mass a law of the load is another mu, so a nuisance may have taken up a part of the level.
    """
    return levelled(evidence, without_nuisances(fitted.model))


def level_of(evidence: Evidence, fitted: Fit) -> Value:
    """Returns the coefficient of friction of that model, with the standard error of a median.

    Where no block was seen to let go, a law of the speed extrapolates static friction to speeds that nobody recorded:
    the level is then that of the recorded slides. The runs scatter, and each reading of an onset has an error of its
    own: a tilt in steps leaves it open within a step.
    """
    model, channel = as_simulated(evidence, fitted), evidence.friction
    assert channel is not None
    known = evidence.known(channel)
    mu = model.mu_s * (1.0 if evidence.onsets is not None else _of_sliding(model, channel.contact, known))
    reading = fitted.noise.factor[channel.name] * float(np.median(channel.rows.sigma[known])) if known.any() else 0.0
    each = math.hypot(fitted.noise.scatter, reading)
    return Value(value=mu, sd=OF_MEDIAN * mu * each / math.sqrt(max(evidence.used(), 1)), unit="1")


def _of_sliding(model: Model, contact: Contact | None, known: Bools) -> float:
    """Returns the friction of the recorded slides over that of the same blocks at rest, by the model.

    A row of a slide has a few contacts, of the nodes of its window.
    """
    if contact is None or not known.any():
        return 1.0
    still = replace(contact, moving=np.zeros(len(contact), dtype=np.bool_), speed_m_s=np.zeros(len(contact)))
    of_rows = np.repeat(known, len(contact) // len(known))
    return float(np.median((model.friction(contact) / model.friction(still))[of_rows]))
