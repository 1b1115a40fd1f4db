"""Maximum likelihood for one model: Newton steps within bounds, the noise estimated anew as the residuals shrink."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear

from station.diagnosis.inference.errors import Curvature
from station.diagnosis.inference.parameters import Free, free_numbers, model_of, vector_of
from station.diagnosis.likelihood.grouped import grouped_noise
from station.diagnosis.likelihood.noise import Noise, estimate_noise
from station.diagnosis.likelihood.slopes import STEP, residuals, slopes
from station.diagnosis.likelihood.student import fitted_tail, log_density, pulls
from station.diagnosis.likelihood.systematic import is_nuisance, nuisances
from station.diagnosis.likelihood.whitening import Whitening, stack
from station.diagnosis.observations.channel import ONSET
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.onsets import Onsets
from station.physics.contact import Array, Bools
from station.physics.effect import Effect
from station.physics.model import Model
from station.physics.parameter import Parameter

MOST_STEPS = 25
"""The largest number of Newton steps between two noise estimates."""
CONVERGED = 1e-3
"""A step that promises a smaller gain in log likelihood ends the search."""

NOISE_ROUNDS = 3
"""The largest number of noise estimates after the first."""
WORTH_RENEWING = 0.5
"""A new noise estimate is kept if it raises the log likelihood by more than this."""

FARTHEST, FARTHEST_SHAPE = 30.0, 3.0
"""The longest steps, in typical sizes: a shape has no slope where its effect vanishes and must not run away, and the
slope of a law by its shape holds only nearby."""

SHRUNK = (1.0, 0.5, 0.2, 0.05, 0.01)
"""The factors by which a step is shortened, one after another."""
ENOUGH = 0.2
"""A step must bring this share of its promised gain, or else it is shortened: a step to the far end of a shape's range
may gain a little and end where nothing has a slope (Armijo 1966, Pac. J. Math. 16, 1)."""

LEAST_FACTOR = 1e-3
"""The smallest factor on a nominal error: a simulation without noise still rounds its numbers. With less, the
covariance of a run whose rows share its friction has no Cholesky factor (`station diagnose` of a planar simulation).
"""

AGAIN = 0.25
"""Newton steps reuse their slopes while each promises less than this share of the last one's gain: the slopes of a
linear model are the same everywhere, and such a step costs one evaluation instead of one for each number (Shamanskii
1967, Ukr. Mat. Zh. 19, 133). A search ends only with slopes that were taken within one finite difference of its end.
"""

_RIDGE = 1e-9


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
        """Standard error of a parameter in its unit; nan if it is not free."""
        place = self._place(effect_id, parameter)
        if place is None:
            return math.nan
        return float(np.sqrt(max(self.covariance[place, place], 0.0))) * self.free[place].scale

    def at_bound(self, effect_id: str, parameter: str) -> bool:
        """True if a parameter is free and at one of its bounds."""
        place = self._place(effect_id, parameter)
        return place is not None and not self.free[place].low < self.vector[place] < self.free[place].high

    def of_effect(self, effect_id: str) -> tuple[tuple[Parameter, ...], Array]:
        """The free parameters (k,) of an effect and their covariance (k, k), in their units."""
        places = [place for place, number in enumerate(self.free) if number.effect and number.effect.id == effect_id]
        scale = np.array([self.free[place].scale for place in places])
        numbers = tuple(number for place in places if (number := self.free[place].parameter) is not None)
        return numbers, self.covariance[np.ix_(places, places)] * np.outer(scale, scale)

    def _place(self, effect_id: str, parameter: str) -> int | None:
        names = [(one.effect.id, one.parameter.name) if one.effect and one.parameter else None for one in self.free]
        return names.index((effect_id, parameter)) if (effect_id, parameter) in names else None


def fit(
    evidence: Evidence,
    start: Model,
    effects: Sequence[Effect],
    *,
    noise: Noise | None = None,
    refine: bool = True,
    steps: int = MOST_STEPS,
    level: bool = True,
) -> Fit:
    """Fits mu_s and the effects' parameters from `start`.

    Args:
        evidence: the data; log densities are computed for all its runs, also for those that are held out.
        start: the model to begin with; its effects that are not in `effects` keep their values.
        effects: the effects whose parameters are free.
        noise: the noise to begin with; None: it is estimated from the residuals at the start.
        refine: if True, the noise is estimated anew as long as that makes the recording more likely.
        steps: the largest number of Newton steps.
        level: if False, mu_s keeps its value.
    """
    named = [effect for effect in effects if not is_nuisance(effect)]
    free = free_numbers(evidence, [*nuisances(evidence, start), *named])[0 if level else 1 :]
    search = _Search(evidence, start, free, noise=noise)
    converged = search.climb(steps)
    for _ in range(NOISE_ROUNDS if refine else 0):
        if not search.renew_noise():
            break
        converged = search.climb(steps)
    return search.result(converged)


@dataclass(frozen=True, eq=False)
class _Tried:
    """A point of the search that a step leads to."""

    vector: Array
    model: Model
    at: dict[str, Array]
    white: Array
    whitening: Whitening


class _Search:
    def __init__(self, evidence: Evidence, start: Model, free: tuple[Free, ...], *, noise: Noise | None) -> None:
        self.evidence, self.free = evidence, free
        self.counts = evidence.counted
        self.vector = vector_of(start, free)
        self.low = np.array([number.low for number in free])
        self.high = np.array([number.high for number in free])
        self.precision = np.array([number.precision for number in free])
        self.reach = np.array([FARTHEST_SHAPE if number.is_shape else FARTHEST for number in free])
        self.model = model_of(self.vector, free, base=start)
        self.at = residuals(evidence, self.model)
        self.noise = noise or self._noise()
        self._whiten()
        self.slope, self.sloped = np.zeros((len(self.white), 0)), np.full(len(free), np.inf)

    def _noise(self) -> Noise:
        """Estimates the noise from the runs that count."""
        return noise_of(self.evidence, self.at)

    def _whiten(self) -> None:
        self.whitening = Whitening(self.evidence, self.noise, shaking=shaking_of(self.evidence, self.model))
        self.white = self.whitening(stack(self.evidence, self.at))

    def _total(self, white: Array, whitening: Whitening, vector: Array) -> float:
        density = log_density(white, whitening.tail, whitening.limit)
        counted = self.counts[whitening.run]
        prior = -0.5 * float(self.precision @ vector**2)
        return float(density[counted].sum() - whitening.log_scale[self.counts].sum()) + prior

    def climb(self, steps: int) -> bool:
        """Takes Newton steps until there is nothing to gain; False if `steps` were not enough."""
        return any(self.step() for _ in range(steps))

    def renew_noise(self) -> bool:
        """Estimates the noise anew and keeps it where that makes the recording more likely; True if it was kept."""
        before, kept = self._total(self.white, self.whitening, self.vector), (self.noise, self.whitening, self.white)
        self.noise = self._noise()
        self._whiten()
        if self._total(self.white, self.whitening, self.vector) > before + WORTH_RENEWING:
            return True
        self.noise, self.whitening, self.white = kept
        return False

    def step(self) -> bool:
        """Takes one Newton step with new slopes, and more with the same ones; True if there is nothing more to gain."""
        counted = self.counts[self.whitening.run]
        slope = self.whitening(self._slopes())[counted]
        self.curvature = self._curved(slope, counted)
        move, gain = self._promise(self.curvature)
        if gain < CONVERGED:
            return True
        if not self._take(self._searched(move, gain, SHRUNK)):
            return gain < WORTH_RENEWING  # no step gains: this counts as converged only if little was promised
        while True:
            last = gain
            move, gain = self._promise(self._curved(slope, counted))
            if not CONVERGED < gain < AGAIN * last or not self._take(self._searched(move, gain, SHRUNK[:1])):
                return False

    def _slopes(self) -> Array:
        """Slopes (rows, k) of the residuals at the current point; they do not depend on the noise."""
        if np.any(np.abs(self.vector - self.sloped) > STEP):
            self.sloped = self.vector
            self.slope = stack(self.evidence, slopes(self.evidence, self.model, self.free, self.at))
        return self.slope

    def _curved(self, slope: Array, counted: Bools) -> Curvature:
        """The likelihood's curvature from whitened slopes of the components that `counted` (rows,) marks."""
        tail, limit = self.whitening.tail[counted], self.whitening.limit[counted]
        pull, curve = pulls(self.white[counted], tail, limit)
        return Curvature(slope=slope, pull=pull, curve=curve, tail=tail, limit=limit, run=self.whitening.block[counted])

    def _promise(self, at: Curvature) -> tuple[Array, float]:
        """The step (k,) to the maximum of the quadratic model within bounds and reach, and the gain it promises."""
        gradient = at.slope.T @ at.pull + self.precision * self.vector
        hessian = (at.slope * at.curve[:, None]).T @ at.slope + np.diag(self.precision)
        least = np.maximum(self.low - self.vector, -self.reach)
        most = np.minimum(self.high - self.vector, self.reach)
        return _bounded(gradient, hessian, least, most)

    def _searched(self, move: Array, gain: float, shrunk: Sequence[float]) -> _Tried | None:
        """The first of the shortened steps that gains enough, or else the best one; None if none gains."""
        before = self._total(self.white, self.whitening, self.vector)
        best, most = None, before
        for shrink in shrunk:
            tried = self._at(np.clip(self.vector + shrink * move, self.low, self.high))
            total = self._total(tried.white, tried.whitening, tried.vector)
            if total > most:
                best, most = tried, total
            if best is not None and most > before + ENOUGH * shrink * gain:
                break
        return best

    def _take(self, step: _Tried | None) -> bool:
        """Moves to the step's end; False if there is no step."""
        if step is None:
            return False
        self.vector, self.model, self.at = step.vector, step.model, step.at
        self.white, self.whitening = step.white, step.whitening
        return True

    def _at(self, vector: Array) -> _Tried:
        model = model_of(vector, self.free, base=self.model)
        at = residuals(self.evidence, model)
        whitening = self.whitening
        if model.acting("shaking"):
            whitening = Whitening(self.evidence, self.noise, shaking=shaking_of(self.evidence, model))
        return _Tried(vector, model, at, whitening(stack(self.evidence, at)), whitening)

    def result(self, converged: bool) -> Fit:
        density = log_density(self.white, self.whitening.tail, self.whitening.limit)
        log_run = np.bincount(self.whitening.run, density, self.evidence.runs) - self.whitening.log_scale
        return Fit(
            model=replace(self.model, scatter=self.noise.scatter),
            free=self.free,
            vector=self.vector,
            covariance=self.curvature.covariance(self.precision, self.high - self.low),
            noise=self.noise,
            log_run=log_run,
            counted=self.counts,
            white=self.white,
            converged=converged,
            log_prior=-0.5 * float(self.precision @ self.vector**2),
        )


def _bounded(gradient: Array, hessian: Array, least: Array, most: Array) -> tuple[Array, float]:
    """The step (k,) to the quadratic's maximum between two bounds (k,), and the gain that it promises.

    A Newton step that is merely clipped at the bounds can lead downhill: a number that is held at its bound changes the
    others' optimum (Stark & Parker 1995, Comput. Stat. 10, 129: bounded-variable least squares).
    """
    ridge = _RIDGE * max(float(np.trace(hessian)), 1e-12) * np.eye(len(gradient))
    root = np.linalg.cholesky(hessian + ridge)
    found = lsq_linear(root.T, -solve_triangular(root, gradient, lower=True), (least, most), method="bvls")
    move = np.clip(np.asarray(found.x, dtype=np.float64), least, most)
    return move, -float(gradient @ move + 0.5 * move @ hessian @ move)


def noise_of(evidence: Evidence, at: dict[str, Array]) -> Noise:
    """The noise of the runs that count, from the residuals by channel."""
    estimate = estimate_noise if evidence.group is None else grouped_noise
    noise = with_tails(evidence, at, estimate(evidence, at))
    return noise if evidence.floor is None else noise.at_least(evidence.floor)


def with_tails(evidence: Evidence, at: dict[str, Array], noise: Noise) -> Noise:
    """The noise with each channel's tail and scale fitted to the whitened components of the runs that count."""
    whitening = Whitening(evidence, noise)
    white = whitening(stack(evidence, at))
    known = np.concatenate([evidence.known(channel) for channel in evidence.channels])
    friction, own, factor, tail = noise.friction, dict(noise.own), dict(noise.factor), dict(noise.tail)
    for place, channel in enumerate(evidence.channels):
        chosen = known & (whitening.channel == place)
        if evidence.is_record(channel):  # means of many readings have no tail, and no other scale
            continue
        tail[channel.name], scale = fitted_tail(white[chosen])
        if channel.name == ONSET and evidence.group is None:
            # Both parts of the scatter are scaled alike: their ratio is known from the difference of onset and slide.
            friction, own[ONSET] = scale * noise.friction, scale * noise.own[ONSET]
        else:
            factor[channel.name] = max(factor[channel.name] * scale, LEAST_FACTOR)
            if evidence.group is not None:
                own[channel.name] = scale * noise.own[channel.name]
    return replace(noise, friction=friction, own=own, factor=factor, tail=tail)


def shaking_of(evidence: Evidence, model: Model) -> Array | None:
    """Standard deviations (onset rows,) that the model's random pushes add to the onsets; None if there are none."""
    first = evidence.channels[0] if evidence.channels else None
    return first.shaking(model) if isinstance(first, Onsets) and model.acting("shaking") else None
