"""Maximum likelihood for one model: the numbers at the top, and the noise estimated anew as the residuals shrink."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from station.diagnosis.inference.climb import CONVERGED, WORTH_RENEWING, Climb
from station.diagnosis.inference.parameters import Free, free_numbers
from station.diagnosis.likelihood.noise import Noise
from station.diagnosis.likelihood.systematic import is_nuisance
from station.diagnosis.observations.evidence import Evidence
from station.physics.contact import Array, Bools
from station.physics.effect import Effect
from station.physics.model import Model
from station.physics.parameter import Parameter

MOST_STEPS = 25
"""The largest number of Newton steps between two noise estimates."""

NOISE_ROUNDS = 6
"""The largest number of noise estimates after the first: with 3, fits whose noise falls by much at each were 4 nats
short of others that began nearer (`pytest tests/unit/diagnosis/test_climb.py`, without the corners' noise)."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Fit:
    """A fitted model.

    `log_run` (runs,) is each run's log density and `counted` (runs,) marks the runs to which the model was fitted.
    `vector` (k,) are the scaled free numbers, `covariance` (k, k) theirs (see `errors`), `white` (rows,) the whitened
    residuals. `converged` is False if the search did not end at a maximum; `log_prior` is that of the nuisances.
    """

    model: Model
    free: tuple[Free, ...]
    vector: Array
    covariance: Array
    noise: Noise
    log_run: Array
    counted: Bools
    white: Array
    converged: bool
    log_prior: float = 0.0

    @property
    def log_likelihood(self) -> float:
        """The log density of the runs that count, plus the log prior of the nuisances."""
        return float(self.log_run[self.counted].sum()) + self.log_prior

    def sd(self, effect_id: str, parameter: str) -> float:
        """Returns the standard error of a parameter in its unit; nan if it is not free."""
        index = self._index(effect_id, parameter)
        if index is None:
            return math.nan
        return float(np.sqrt(max(self.covariance[index, index], 0.0))) * self.free[index].scale

    def at_bound(self, effect_id: str, parameter: str) -> bool:
        """Returns true if a parameter is free and at one of its bounds."""
        index = self._index(effect_id, parameter)
        return index is not None and not self.free[index].low < self.vector[index] < self.free[index].high

    def of_effect(self, effect_id: str) -> tuple[tuple[Parameter, ...], Array]:
        """Returns the free parameters (k,) of an effect and their covariance (k, k), in their units."""
        numbers, covariance = self.of_effects([effect_id])
        return tuple(one.parameter for one in numbers if one.parameter is not None), covariance

    def of_effects(self, ids: Collection[str]) -> tuple[tuple[Free, ...], Array]:
        """Returns the free numbers (k,) of several effects and their covariance (k, k), in their units."""
        indices = [index for index, number in enumerate(self.free) if number.effect and number.effect.id in ids]
        scale = np.array([self.free[index].scale for index in indices])
        numbers = tuple(self.free[index] for index in indices)
        return numbers, self.covariance[np.ix_(indices, indices)] * np.outer(scale, scale)

    def _index(self, effect_id: str, parameter: str) -> int | None:
        names = [one.name for one in self.free]
        return names.index((effect_id, parameter)) if (effect_id, parameter) in names else None


def fit(
    evidence: Evidence,
    start: Model,
    effects: Sequence[Effect],
    *,
    noise: Noise | None = None,
    level: bool = True,
) -> Fit:
    """Fits mu_s and the effects' parameters from `start`.

    Args:
        evidence: the data; log densities are computed for all its runs, also for those that are held out.
        start: the model to begin with; its effects that are not in `effects` keep their values.
        effects: the effects whose parameters are free.
        noise: the noise to begin with; None: it is estimated from the residuals at the start.
        level: if False, mu_s keeps its value.
    """
    named = [effect for effect in effects if not is_nuisance(effect)]
    free = free_numbers(evidence, start, named)[0 if level else 1 :]
    climb = Climb(evidence, start, free, noise=noise)
    for _ in range(NOISE_ROUNDS):
        climb.climb(MOST_STEPS, WORTH_RENEWING)
        if not climb.renew_noise():
            break
    return _ended(climb, climb.climb(MOST_STEPS, CONVERGED))


def stepped(
    evidence: Evidence, start: Model, effects: Sequence[Effect], *, noise: Noise, held: Collection[str]
) -> Model:
    """Returns the model one Newton step above `start`, in which the effects `held` (ids) keep their shapes.

    Other arguments are as in `fit`, but none of the effects is a nuisance.
    """
    every = free_numbers(evidence, start, effects)
    free = tuple(one for one in every if not (one.is_shape and one.effect and one.effect.id in held))
    climb = Climb(evidence, start, free, noise=noise)
    climb.climb(1, CONVERGED)
    return climb.point.model


def _ended(climb: Climb, converged: bool) -> Fit:
    end, whitening = climb.point, climb.point.whitening
    return Fit(
        model=replace(end.model, scatter=climb.noise.scatter),
        free=climb.free,
        vector=end.vector,
        covariance=climb.curvature.covariance(climb.precision, climb.high - climb.low),
        noise=climb.noise,
        log_run=np.bincount(whitening.run, end.density, climb.evidence.runs) - whitening.log_scale,
        counted=climb.counts,
        white=end.white,
        converged=converged,
        log_prior=-0.5 * float(climb.precision @ end.vector**2),
    )
