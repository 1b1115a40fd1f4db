"""Residuals of all channels and their slopes by a model's free numbers."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import contextmanager

import numpy as np

from station.diagnosis.inference.parameters import Free, moved, vector_of
from station.diagnosis.observations.channel import Channel
from station.diagnosis.observations.evidence import Evidence
from station.physics.contact import Array
from station.physics.model import Model

STEP = 0.02
"""The largest step of the finite differences, in typical sizes of a parameter."""


def residuals(evidence: Evidence, model: Model) -> dict[str, Array]:
    """Returns the residuals (rows,) of each channel by its name."""
    return {channel.name: channel.residual(model) for channel in evidence.channels}


def log_volume(evidence: Evidence, model: Model) -> Array:
    """Returns the log (rows,) of how far residuals move with what was recorded, see `Channel.log_volume`."""
    return np.concatenate([channel.log_volume(model) for channel in evidence.channels])


def volume_slopes(evidence: Evidence, model: Model, free: Sequence[Free]) -> Array:
    """Returns the slopes (rows, k) of the log volume, by one-sided differences within the bounds."""
    vector, here = vector_of(model, free), log_volume(evidence, model)
    found = np.zeros((len(here), len(free)))
    for index, number in enumerate(free):
        step = STEP if vector[index] + STEP <= number.high else -STEP
        found[:, index] = (log_volume(evidence, moved(model, number, step)) - here) / step
    return found


def slopes(
    evidence: Evidence, model: Model, free: Sequence[Free], at: dict[str, Array], *, steps: Array | None = None
) -> dict[str, Array]:
    """Returns slopes (rows, k) by channel of the residuals `at` the model, by one-sided differences within the bounds.

    `steps` (k,) are those of the differences, in typical sizes; STEP where they are not given. Slopes that an effect
    cannot have in a channel are zero and not evaluated.
    """
    with near(evidence, model):
        return differences(evidence, model, free, at, steps=steps)


@contextmanager
def near(evidence: Evidence, model: Model) -> Generator[None]:
    """Tells the channels that all models evaluated inside lie close to this one, see `Channel.near`."""
    for channel in evidence.channels:
        channel.near(model)
    try:
        yield
    finally:
        for channel in evidence.channels:
            channel.near(None)


def differences(
    evidence: Evidence, model: Model, free: Sequence[Free], at: dict[str, Array], *, steps: Array | None = None
) -> dict[str, Array]:
    """Returns the slopes (rows, k) as in `slopes`, by `steps` (k,), inside a context that `near` has opened."""
    vector = vector_of(model, free)
    sizes = np.full(len(free), STEP) if steps is None else steps
    found = {name: np.zeros((len(values), len(free))) for name, values in at.items()}
    for index, (number, size) in enumerate(zip(free, sizes.tolist(), strict=True)):
        step = size if vector[index] + size <= number.high else -size
        changed = moved(model, number, step)
        for channel in evidence.channels:
            if _changes(channel, number):
                found[channel.name][:, index] = (channel.residual(changed) - at[channel.name]) / step
    return found


def _changes(channel: Channel, number: Free) -> bool:
    if number.effect is None:
        return channel.frictional
    return channel.changed_by(number.effect)
