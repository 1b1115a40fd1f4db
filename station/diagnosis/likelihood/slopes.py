"""Residuals of all channels and their slopes by a model's free numbers."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager

import numpy as np

from station.diagnosis.inference.parameters import Free, moved, vector_of
from station.diagnosis.observations.channel import Channel
from station.diagnosis.observations.evidence import Evidence
from station.physics.contact import Array
from station.physics.effect import Effect
from station.physics.model import Model

STEP = 0.02
"""The largest step of the finite differences, in typical sizes of a parameter."""


def residuals(evidence: Evidence, model: Model) -> dict[str, Array]:
    """Returns the residuals (rows,) of each channel by its name."""
    return {channel.name: channel.residual(model) for channel in evidence.channels}


def decays(evidence: Evidence, model: Model) -> Array:
    """Returns what friction undoes (rows,), in the stacked order of the channels, see `Channel.decay`."""
    return np.concatenate([channel.decay(model) for channel in evidence.channels])


def plain_decays(evidence: Evidence) -> Array:
    """Returns what friction undoes (rows,) under a model without effects, see `decays`."""
    return decays(evidence, Model(mu_s=1.0))


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
    sizes = np.full(len(free), STEP) if steps is None else steps
    found = {name: np.zeros((len(values), len(free))) for name, values in at.items()}
    for index, (number, step, changed) in enumerate(_changed(model, free, sizes)):
        for channel in evidence.channels:
            if _changes(channel, number, channel.changed_by):
                found[channel.name][:, index] = (channel.residual(changed) - at[channel.name]) / step
    return found


def decay_differences(evidence: Evidence, model: Model, free: Sequence[Free]) -> dict[str, Array]:
    """Returns the slopes (rows, k) by channel of what `decays` returns, by one-sided differences within the bounds."""
    at = {channel.name: channel.decay(model) for channel in evidence.channels}
    found = {name: np.zeros((len(values), len(free))) for name, values in at.items()}
    for index, (number, step, changed) in enumerate(_changed(model, free, np.full(len(free), STEP))):
        for channel in evidence.channels:
            if channel.undone_by and _changes(channel, number, channel.decays_by):
                found[channel.name][:, index] = (channel.decay(changed) - at[channel.name]) / step
    return found


def _changed(model: Model, free: Sequence[Free], sizes: Array) -> Generator[tuple[Free, float, Model]]:
    """Yields each number, its step, of `sizes` (k,) in its typical size, and the model with that step."""
    for number, at, size in zip(free, vector_of(model, free).tolist(), sizes.tolist(), strict=True):
        step = size if at + size <= number.high else -size
        yield number, step, moved(model, number, step)


def _changes(channel: Channel, number: Free, by: Callable[[Effect], bool]) -> bool:
    return channel.frictional if number.effect is None else by(number.effect)
