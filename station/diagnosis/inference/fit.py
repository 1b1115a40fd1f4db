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
from station.diagnosis.likelihood.noise import Noise, estimate_noise
from station.diagnosis.likelihood.slopes import STEP, residuals, slopes
from station.diagnosis.likelihood.student import fitted_tail, log_density, pulls
from station.diagnosis.likelihood.systematic import is_nuisance, nuisances, without_nuisances
from station.diagnosis.likelihood.whitening import Whitening, stack
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.onsets import Onsets
from station.physics.contact import Array, Bools
from station.physics.effect import Effect
from station.physics.model import Model
from station.physics.parameter import Parameter

MOST_STEPS = 25
CONVERGED = 1e-3
"""A step whose predicted gain in log likelihood is below this ends the search."""

NOISE_ROUNDS = 3
WORTH_RENEWING = 0.5

FARTHEST, FARTHEST_SHAPE = 30.0, 3.0
"""Typical sizes of one step at most: a shape without an effect has no slope, and must not run away; and how it bends
the law is known only near where it is."""

SHRUNK = (1.0, 0.5, 0.2, 0.05, 0.01)
ENOUGH = 0.2
"""The share of the promised gain that a step must bring, or else it is shortened: one to the far end of a shape's range
may gain a little, and leads to where nothing has a slope (Armijo 1966, Pac. J. Math. 16, 1)."""

LEAST_FACTOR = 1e-3
"""Of a measurement's nominal error: a simulation without noise still rounds its numbers. With less, the covariance of a
run whose rows share its friction has no Cholesky factor (`station diagnose` of a planar simulation)."""

AGAIN = 0.25
"""Steps go on by the same slopes while each promises less than this share of what the last one did: a linear model's
residuals have the same slopes everywhere, and a step costs one evaluation then, not one for each number (Shamanskii
1967, Ukr. Mat. Zh. 19, 133). A search ends only by slopes that were taken where it ends, or no farther away than one
step of a difference."""

_RIDGE = 1e-9


@dataclass(frozen=True, eq=False, kw_only=True)
class Fit:
    """A fitted model.

    `log_run` (runs,) is each run's log density, `counted` (runs,) says to which the model was fitted; `covariance`
    (k, k) is that of `vector` in scaled numbers (see `errors`); `converged` is False where the search ended elsewhere
    than at a maximum; `log_prior` is the nuisances'.
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
        """Of the runs that count, and of what the nuisances had to bend to explain them."""
        return float(self.log_run[self.counted].sum()) + self.log_prior

    def sd(self, effect_id: str, parameter: str) -> float:
        """Standard error of a parameter in its unit; nan if it is not free."""
        place = self._place(effect_id, parameter)
        if place is None:
            return math.nan
        return float(np.sqrt(max(self.covariance[place, place], 0.0))) * self.free[place].scale

    def at_bound(self, effect_id: str, parameter: str) -> bool:
        """True if a parameter is free and where its bounds end."""
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
) -> Fit:
    """Fits mu_s and the effects' parameters from `start`.

    Args:
        evidence: what to fit to; the log densities are of all its runs, also of those that are held out.
        start: where to begin; effects that it has and that are not in `effects` stay as they are.
        effects: whose parameters are free.
        noise: to begin with; None: estimated from the residuals at the start.
        refine: whether the noise is estimated anew where that makes the recording more likely.
        steps: how many Newton steps at most.
    """
    named = [effect for effect in effects if not is_nuisance(effect)]
    free = free_numbers(evidence, [*nuisances(evidence, start), *named])
    search = _Search(evidence, start, free, noise=noise)
    converged = search.climb(steps)
    for _ in range(NOISE_ROUNDS if refine else 0):
        if not search.renew_noise():
            break
        converged = search.climb(steps)
    return search.result(converged)


def levelled(evidence: Evidence, start: Model) -> Model:
    """The model with a coefficient near the recorded ones: far from them the scatter would read many times too large.

    A first noise that is too large makes every later one so, and nothing would be seen.
    """
    channel = evidence.channel("onset") or evidence.channel("along")
    rows = channel.rows if channel else None
    known = channel.residual(start)[~rows.limit & evidence.counted[rows.run]] if channel and rows else np.zeros(0)
    return replace(start, mu_s=start.mu_s * math.exp(float(np.median(known)))) if len(known) else start


def as_simulated(evidence: Evidence, fitted: Fit) -> Model:
    """The model without what is only allowed for, at the recorded level: what a simulator takes.

    With one mass a law of the load is another mu: what is allowed for took a part of the level with it.
    """
    return levelled(evidence, without_nuisances(fitted.model))


@dataclass(frozen=True, eq=False)
class _Tried:
    """Where a step would lead."""

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
        self.slope, self.sloped = np.zeros(0), np.full(len(free), np.inf)
        self.noise = noise or self._noise()
        self._whiten()

    def _noise(self) -> Noise:
        """Of the runs that count."""
        known = restricted(self.evidence, self.at, self.counts)
        noise = with_tails(known[0], known[1], estimate_noise(*known))
        return noise if self.evidence.floor is None else noise.at_least(self.evidence.floor)

    def _whiten(self) -> None:
        self.whitening = Whitening(self.evidence, self.noise, shaking=shaking_of(self.evidence, self.model))
        self.white = self.whitening(stack(self.evidence, self.at))

    def _total(self, white: Array, whitening: Whitening, vector: Array) -> float:
        density = log_density(white, whitening.tail, whitening.limit)
        counted = self.counts[whitening.run]
        prior = -0.5 * float(self.precision @ vector**2)
        return float(density[counted].sum() - whitening.log_scale[self.counts].sum()) + prior

    def climb(self, steps: int) -> bool:
        """Newton steps until there is nothing to gain; False if `steps` were not enough."""
        return any(self.step() for _ in range(steps))

    def renew_noise(self) -> bool:
        """Estimates the noise anew and keeps it where that makes the recording more likely; whether it did."""
        before, kept = self._total(self.white, self.whitening, self.vector), (self.noise, self.whitening, self.white)
        self.noise = self._noise()
        self._whiten()
        if self._total(self.white, self.whitening, self.vector) > before + WORTH_RENEWING:
            return True
        self.noise, self.whitening, self.white = kept
        return False

    def step(self) -> bool:
        """New slopes, and the steps that they lead; whether there was nothing more to gain."""
        counted = self.counts[self.whitening.run]
        slope = self.whitening(self._slopes())[counted]
        self.curvature = self._curved(slope, counted)
        move, gain = self._promise(self.curvature)
        if gain < CONVERGED:
            return True
        if not self._take(self._searched(move, gain, SHRUNK)):
            return gain < WORTH_RENEWING  # no way up from here: as good as converged only if little was to be gained
        while True:
            last = gain
            move, gain = self._promise(self._curved(slope, counted))
            if not CONVERGED < gain < AGAIN * last or not self._take(self._searched(move, gain, SHRUNK[:1])):
                return False

    def _slopes(self) -> Array:
        """Of the residuals (rows, k), where the search stands; new noise does not change them."""
        if np.any(np.abs(self.vector - self.sloped) > STEP):
            self.sloped = self.vector
            self.slope = stack(self.evidence, slopes(self.evidence, self.model, self.free, self.at))
        return self.slope

    def _curved(self, slope: Array, counted: Bools) -> Curvature:
        """Of the likelihood, by whitened slopes, of the components (rows,) that are `counted`."""
        tail, limit = self.whitening.tail[counted], self.whitening.limit[counted]
        pull, curve = pulls(self.white[counted], tail, limit)
        return Curvature(slope=slope, pull=pull, curve=curve, tail=tail, limit=limit, run=self.whitening.run[counted])

    def _promise(self, at: Curvature) -> tuple[Array, float]:
        """The step to the top, within bounds and reach, and what it would gain."""
        gradient = at.slope.T @ at.pull + self.precision * self.vector
        hessian = (at.slope * at.curve[:, None]).T @ at.slope + np.diag(self.precision)
        least = np.maximum(self.low - self.vector, -self.reach)
        most = np.minimum(self.high - self.vector, self.reach)
        return _bounded(gradient, hessian, least, most)

    def _searched(self, move: Array, gain: float, shrunk: Sequence[float]) -> _Tried | None:
        """Where a step leads up, the first that brings enough; None where it does not."""
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
        """Goes there; whether there is anywhere to go."""
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
    """The step to the top of the quadratic between two bounds, and the gain that it promises.

    A Newton step that is merely cut off at the bounds can lead downhill: what is held at its bound changes where the
    others belong (Stark & Parker 1995, Comput. Stat. 10, 129: bounded-variable least squares).
    """
    ridge = _RIDGE * max(float(np.trace(hessian)), 1e-12) * np.eye(len(gradient))
    root = np.linalg.cholesky(hessian + ridge)
    found = lsq_linear(root.T, -solve_triangular(root, gradient, lower=True), (least, most), method="bvls")
    move = np.clip(np.asarray(found.x, dtype=np.float64), least, most)
    return move, -float(gradient @ move + 0.5 * move @ hessian @ move)


def restricted(evidence: Evidence, at: dict[str, Array], runs: Bools) -> tuple[Evidence, dict[str, Array]]:
    """The evidence as it is, and residuals in which runs that do not count are left out of the noise's estimate."""
    if runs.all():
        return evidence, at
    return evidence.only(runs), {
        channel.name: at[channel.name][runs[channel.rows.run]] for channel in evidence.channels
    }


def with_tails(evidence: Evidence, at: dict[str, Array], noise: Noise) -> Noise:
    """The noise with each channel's tail, and its scale, fitted to the whitened components."""
    whitening = Whitening(evidence, noise)
    white = whitening(stack(evidence, at))
    friction, own, factor, tail = noise.friction, dict(noise.own), dict(noise.factor), dict(noise.tail)
    for place, channel in enumerate(evidence.channels):
        chosen = (whitening.channel == place) & ~whitening.limit
        tail[channel.name], scale = fitted_tail(white[chosen])
        if channel.name == "onset":
            # Both parts of the scatter alike: what onset and slide do not share is known from their difference.
            friction, own["onset"] = scale * noise.friction, scale * noise.own["onset"]
        else:
            factor[channel.name] = max(factor[channel.name] * scale, LEAST_FACTOR)
    return Noise(friction=friction, own=own, factor=factor, tail=tail)


def shaking_of(evidence: Evidence, model: Model) -> Array | None:
    """Standard deviations by the model's random pushes, for the onset's rows; None if there are none."""
    if not model.acting("shaking") or not evidence.channels or evidence.channels[0].name != "onset":
        return None
    first = evidence.channels[0]
    return first.shaking(model) if isinstance(first, Onsets) else None
