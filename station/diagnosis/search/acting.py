"""Finds the phases and runs in which an effect acts: there a model without it would expect something else.

Some effects leave no residual structure: a shaking arm scatters onsets, a rolling shutter bends marks by their own
motion, and the foam pushes a few blocks at their ends. The model that has them knows all the same where they act.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from station.diagnosis.inference.fit import Fit
from station.diagnosis.likelihood.noise import Noise
from station.diagnosis.likelihood.systematic import less
from station.diagnosis.observations.channel import PHASES, Channel
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.onsets import Onsets
from station.diagnosis.result import Acting
from station.physics.contact import Array
from station.physics.effect import Effect
from station.physics.model import Model


def acting(evidence: Evidence, fitted: Fit, *effects: Effect) -> tuple[Acting, ...]:
    """Gives the phases in which effects of a fitted model act, in the order of a run, with their size in each run."""
    model, without = fitted.model, less(fitted.model, *(effect.id for effect in effects))
    channels = [channel for channel in evidence.channels if any(map(channel.changed_by, effects))]
    changes = {channel.name: channel.residual(without) - channel.residual(model) for channel in channels}
    level = _level(evidence, changes)
    phases: dict[str, Array] = {}
    for channel in channels:
        change = changes[channel.name] - (level if channel.shares_friction else 0.0)
        square = change**2 + _scattered(channel, model, without)
        size = _of_runs(channel, np.sqrt(square) / _spread(channel, fitted.noise), evidence.runs)
        phases[channel.phase] = np.fmax(size, phases.get(channel.phase, size))
    found = (_in_phase(evidence, phase, phases[phase]) for phase in PHASES if phase in phases)
    return tuple(one for one in found if one.runs)


def _level(evidence: Evidence, changes: Mapping[str, Array]) -> float:
    """Gives the median change of ln friction at the onsets, or of sliding friction alone, which another mu has too."""
    friction = evidence.friction
    change = changes.get(friction.name, np.zeros(1)) if friction else np.zeros(1)
    known = change[np.isfinite(change)]
    return float(np.median(known)) if len(known) else 0.0


def _scattered(channel: Channel, model: Model, without: Model) -> Array | float:
    """Returns the variance (n,) of a random push, of which only the spread is known."""
    if not isinstance(channel, Onsets):
        return 0.0
    return np.square(channel.shaking(model)) - np.square(channel.shaking(without))


def _spread(channel: Channel, noise: Noise) -> Array:
    """Gives the standard deviation (n,) of a row between equal runs: its reading's, its run's, and that of the path."""
    wander = noise.wander.get(channel.name)
    square = noise.of_reading(channel) + noise.own[channel.name] ** 2 + noise.group.get(channel.name, 0.0) ** 2
    square += noise.friction**2 if channel.shares_friction else 0.0
    return np.sqrt(square + (wander.sd**2 if wander else 0.0))


def _of_runs(channel: Channel, size: Array, runs: int) -> Array:
    """Returns root mean squares (runs,) of the rows' sizes (n,); nan for a run without rows."""
    count = np.bincount(channel.rows.run, minlength=runs)
    total = np.bincount(channel.rows.run, size**2, minlength=runs)
    return np.sqrt(np.where(count > 0, total / np.maximum(count, 1), np.nan))


def _in_phase(evidence: Evidence, phase: str, sizes: Array) -> Acting:
    known = np.flatnonzero(np.isfinite(sizes))
    numbers = evidence.run_number[known].astype(int).tolist()
    return Acting(phase=phase, runs=tuple(numbers), sizes=tuple(np.round(sizes[known], 3).tolist()))
