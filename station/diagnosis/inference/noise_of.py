"""The noise of a recording from the residuals that a model leaves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.likelihood.grouped import grouped_noise
from station.diagnosis.likelihood.noise import TAILS, Noise, estimate_noise
from station.diagnosis.likelihood.student import fitted_tail
from station.diagnosis.likelihood.whitening import Whitening, stack
from station.diagnosis.observations.channel import ONSET
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.onsets import Onsets
from station.physics.contact import Array
from station.physics.model import Model

LEAST_FACTOR = 1e-3
"""The smallest factor on a nominal error: a simulation without noise still rounds its numbers. With less, the
covariance of a run whose rows share its friction has no Cholesky factor (`station diagnose` of a planar simulation).
"""


def noise_of(evidence: Evidence, at: dict[str, Array]) -> Noise:
    """Returns the noise of the runs that count, from the residuals by channel."""
    estimate = estimate_noise if evidence.group is None else grouped_noise
    noise = with_tails(evidence, at, estimate(evidence, at))
    return noise if evidence.floor is None else noise.at_least(evidence.floor)


def with_tails(evidence: Evidence, at: dict[str, Array], noise: Noise) -> Noise:
    """Returns the noise with each channel's tail and scale fitted to the whitened components of the runs that count."""
    whitening = Whitening(evidence, noise)
    white = whitening(stack(evidence, at))
    known = np.concatenate([evidence.known(channel) for channel in evidence.channels])
    strayed = np.concatenate(
        [channel.rows.strayed & evidence.counted[channel.rows.run] for channel in evidence.channels]
    )
    friction, own, factor, tail = noise.friction, dict(noise.own), dict(noise.factor), dict(noise.tail)
    astray, astray_tail = dict(noise.astray), dict[str, float]()
    for index, channel in enumerate(evidence.channels):
        chosen = known & (whitening.channel == index)
        if evidence.is_record(channel):  # means of many readings have no tail, and no other scale
            continue
        tail[channel.name], scale = fitted_tail(white[chosen])
        astray_tail[channel.name], share = _tail_of_strayed(white[strayed & (whitening.channel == index)])
        astray[channel.name] = min(share * noise.astray.get(channel.name, 1.0), 1.0)
        if channel.name == ONSET and evidence.group is None:
            # Both parts of the scatter are scaled alike: their ratio is known from the difference of onset and slide.
            friction, own[ONSET] = scale * noise.friction, scale * noise.own[ONSET]
        else:
            factor[channel.name] = max(factor[channel.name] * scale, LEAST_FACTOR)
            if evidence.group is not None:
                own[channel.name] = scale * noise.own[channel.name]
    return replace(noise, friction=friction, own=own, factor=factor, tail=tail, astray=astray, astray_tail=astray_tail)


def _tail_of_strayed(white: Array) -> tuple[float, float]:
    """Returns the tail and the scale of rows led astray, by their components (n,): too few may have any tail."""
    return fitted_tail(white) if len(white) >= thresholds.LEAST_SCALED else (min(TAILS), 1.0)


def shaking_of(evidence: Evidence, model: Model) -> Array | None:
    """Gives standard deviations (n,) that the model's random pushes add to n onsets' residuals; None without pushes."""
    first = evidence.channels[0] if evidence.channels else None
    return first.shaking(model) if isinstance(first, Onsets) and model.acting("shaking") else None
