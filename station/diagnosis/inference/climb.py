"""The climb to a likelihood's maximum: Newton steps within bounds that bend where their valley does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from station.diagnosis.inference.errors import Curvature
from station.diagnosis.inference.noise_of import noise_of, shaking_of
from station.diagnosis.inference.parameters import Free, model_of, vector_of
from station.diagnosis.inference.quadratic import Quadratic
from station.diagnosis.likelihood.feedback import owed, owed_slope
from station.diagnosis.likelihood.noise import Noise
from station.diagnosis.likelihood.slopes import STEP, decay_differences, decays, plain_decays, residuals, slopes
from station.diagnosis.likelihood.student import log_density, pulls
from station.diagnosis.likelihood.whitening import Whitening, stack
from station.diagnosis.observations.evidence import Evidence
from station.physics.contact import Array
from station.physics.model import Model

CONVERGED = 1e-3
"""A step that promises a smaller gain in log likelihood is not taken."""
WORTH_RENEWING = 0.5
"""A new noise estimate is kept if it raises the log likelihood by more than this; it is not worth a climb for less."""

FARTHEST, FARTHEST_SHAPE = 30.0, 3.0
"""The longest steps, in typical sizes: a shape has no slope where its effect vanishes and must not run away, and the
slope of a law by its shape holds only nearby."""

SHRUNK = (1.0, 0.5, 0.2, 0.05, 0.01)
"""The factors by which a step is shortened, one after another."""
LITTLE = 0.1
"""A step that is shortened to less than this share is tried with damping, too, and the likelier end is taken. With
damping alone a valley without noise is too narrow (`pytest tests/recovery/test_imported_tracks.py -k fixed_slope`)."""
DAMPED = (1e-3, 1e-2, 1e-1, 1.0, 10.0)
"""The dampings of a step that gains too little even when it is shortened, one after another: shares of each number's
own curvature (Marquardt 1963, J. SIAM 11, 431). What is told well goes its way, and what is hardly told, whose long
moves break the slopes, goes little. Only shortened, a fit of friction by place, with 27 numbers, gained a hundredth of
what it promised in each of 106 steps; damped, it converges in a quarter of the time, 4 nats higher (`pytest
tests/recovery/test_given_simulation.py -k "difference and left and not level"`)."""
ENOUGH = 0.2
"""A step must bring this share of its promised gain, or else it is shortened: a step to the far end of a shape's range
may gain a little and end where nothing has a slope (Armijo 1966, Pac. J. Math. 16, 1)."""

AGAIN = 0.25
"""Newton steps reuse their slopes while each promises less than this share of the last one's gain: the slopes of a
linear model are the same everywhere, and such a step costs one evaluation instead of one for each number (Shamanskii
1967, Ukr. Mat. Zh. 19, 133). A climb ends only with slopes that were taken near its end.
"""
NEARBY = 0.25
"""Slopes hold where no number has moved by more than one finite difference, or by this share of the standard error that
it would have if all others were known: so little bends no valley (`pytest tests/unit/diagnosis/test_climb.py`). Fits of
series, whose numbers are known badly one by one, take a fifth less time."""

LEAST_STEP = 1e-5
"""The smallest step of the finite differences, in typical sizes: residuals are exact to about its square."""


@dataclass(frozen=True, eq=False)
class Point:
    """The numbers (k,), their model, its residuals by channel, and these whitened (rows,).

    `decay` (rows,) is what friction undoes of the rows' own motion, and `plain_decay` (rows,) without effects, see
    `likelihood.feedback`.
    """

    vector: Array
    model: Model
    at: dict[str, Array]
    white: Array
    whitening: Whitening
    decay: Array
    plain_decay: Array

    @cached_property
    def density(self) -> Array:
        """The log density (rows,) of each component, which several steps ask for."""
        density = log_density(self.white, self.whitening.tail, self.whitening.limit)
        return density + owed(self.whitening, self.decay, self.plain_decay)


@dataclass(frozen=True, eq=False)
class Aim:
    """A step `move` (k,) to the maximum of the `quadratic` model by the curvature `here`, and the promised `gain`."""

    here: Curvature
    quadratic: Quadratic
    move: Array
    gain: float


class Climb:
    """One climb: `point` is where it stands, `noise` the noise there, and `curvature` that of its last step.

    `slope` (rows, k), if given, is from nearby: it is used until a step does not bring what it promised.
    """

    point: Point
    curvature: Curvature

    def __init__(
        self,
        evidence: Evidence,
        start: Model,
        free: tuple[Free, ...],
        *,
        noise: Noise | None,
        slope: Array | None = None,
    ) -> None:
        self.evidence, self.free = evidence, free
        self.counts = evidence.counted
        self.low = np.array([number.low for number in free])
        self.high = np.array([number.high for number in free])
        self.precision = np.array([number.precision for number in free])
        self._plain_decay = plain_decays(evidence)
        self._reach = np.array([FARTHEST_SHAPE if number.is_shape else FARTHEST for number in free])
        vector = vector_of(start, free)
        model = model_of(vector, free, base=start)
        at = residuals(evidence, model)
        self.noise = noise or noise_of(evidence, at)
        self.point = self._whitened(vector, model, at)
        self._slope, self._stale = np.zeros((len(self.point.white), 0)) if slope is None else slope, slope is None
        # Where slopes are to be taken first, those of the decay are taken with them.
        self._decay_slope = self._slope if slope is None else stack(evidence, decay_differences(evidence, model, free))
        self._sloped: Array | None = None
        self._steps: Array | None = None
        self._near = np.full(len(free), STEP)

    def climb(self, steps: int, enough: float) -> bool:
        """Takes Newton steps until one promises less than `enough`; False if it does not come to that.

        Where a step does not bring what it promised, slopes are taken anew, right there and by the differences that the
        curvature asks for. If these lead nowhere either, the climb has converged only if little was promised.
        """
        for _ in range(steps):
            exact = self._take_slopes()
            promised, gained = self._step()
            if promised < enough:
                return True
            if exact and gained < CONVERGED:
                return promised < WORTH_RENEWING
            self._stale = gained < ENOUGH * promised
        return False

    def renew_noise(self) -> bool:
        """Estimates the noise anew and keeps it where that makes the recording more likely; True if it was kept."""
        before, kept = self._total(self.point), (self.noise, self.point)
        self.noise = noise_of(self.evidence, self.point.at)
        self.point = self._whitened(self.point.vector, self.point.model, self.point.at)
        if self._total(self.point) > before + WORTH_RENEWING:
            return True
        self.noise, self.point = kept
        return False

    @property
    def log_likelihood(self) -> float:
        """The log density, where the climb stands, of the runs that count, and of the numbers' priors."""
        return self._total(self.point)

    def promised(self) -> float:
        """Returns the log likelihood to which the quadratic model here promises that the climb leads."""
        self._take_slopes()
        return self.log_likelihood + self._aim(self._whitened_slopes()).gain

    def _take_slopes(self) -> bool:
        """Takes slopes (rows, k) of the residuals, which do not depend on the noise, unless the last ones hold here.

        Gives True if they were taken right here, by differences of no more than each number's own standard error.
        """
        here, steps = self.point, self._steps
        far = self._sloped is not None and np.any(np.abs(here.vector - self._sloped) > self._near)
        if not self._stale and not far:
            return False
        self._sloped = here.vector
        self._slope = stack(self.evidence, slopes(self.evidence, here.model, self.free, here.at, steps=steps))
        self._decay_slope = stack(self.evidence, decay_differences(self.evidence, here.model, self.free))
        return steps is not None

    def _owed_slope(self) -> Array:
        """Returns the slopes (k,) of what the rows that count owe to their own motion."""
        whitening = self.point.whitening
        counted = self.counts[whitening.run]
        return owed_slope(whitening, self.point.decay)[counted] @ self._decay_slope[counted]

    def _step(self) -> tuple[float, float]:
        """Takes one Newton step, and more with the same slopes: the gain that the first promised, and what all gained.

        A step that promises less than CONVERGED is not taken.
        """
        before, slope = self._total(self.point), self._whitened_slopes()
        first = aim = self._aim(slope)
        self.curvature = first.here
        sd = 1.0 / np.sqrt(np.maximum(np.diag(first.quadratic.hessian), LEAST_STEP**2))
        self._steps, self._near = np.clip(sd, LEAST_STEP, STEP), np.maximum(STEP, NEARBY * sd)
        last, shrunk = np.inf, SHRUNK
        while CONVERGED < aim.gain < AGAIN * last and self._moved(aim, shrunk):
            last, shrunk = aim.gain, SHRUNK[:1]
            aim = self._aim(slope)
        return first.gain, self._total(self.point) - before

    def _whitened_slopes(self) -> Array:
        """Returns the slopes (n, k), whitened, of the components that count."""
        whitening = self.point.whitening
        return whitening(self._slope)[self.counts[whitening.run]]

    def _aim(self, slope: Array) -> Aim:
        """Returns the step to the maximum of the quadratic model, from whitened slopes of the components that count."""
        vector, here = self.point.vector, self._curved(slope)
        quadratic = Quadratic.of(here, vector, self.precision, self._owed_slope())
        return Aim(here, quadratic, *quadratic.step(*self._room(vector)))

    def _room(self, vector: Array) -> tuple[Array, Array]:
        """Returns the least and the longest step (k,) of each number from `vector` (k,)."""
        return np.maximum(self.low - vector, -self._reach), np.minimum(self.high - vector, self._reach)

    def _curved(self, slope: Array) -> Curvature:
        """Returns the likelihood's curvature here, from whitened slopes of the components that count."""
        whitening = self.point.whitening
        counted = self.counts[whitening.run]
        tail, limit = whitening.tail[counted], whitening.limit[counted]
        pull, curve = pulls(self.point.white[counted], tail, limit)
        return Curvature(slope=slope, pull=pull, curve=curve, tail=tail, limit=limit, run=whitening.block[counted])

    def _moved(self, aim: Aim, shrunk: Sequence[float]) -> bool:
        """Goes by the first of the shortened steps, and then of damped ones, that gains enough, or else by the best.

        False if none gains.
        """
        start = self.point
        if self._shortened(aim, start, shrunk) < LITTLE and len(shrunk) > 1:
            self._damped(aim, start)
        return self.point is not start

    def _shortened(self, aim: Aim, start: Point, shrunk: Sequence[float]) -> float:
        """Goes by the first of the shortened steps that gains enough, or else by the best.

        Gives the share of the step that gains enough, 0 if none does. What a step shows beside its slopes bends the
        next one.
        """
        before = most = self._total(start)
        bend = np.zeros_like(aim.move)
        for shrink in shrunk:
            tried = self._at(start.vector + shrink * aim.move + 0.5 * shrink**2 * bend)
            most = self._kept(tried, most)
            if most > before + ENOUGH * shrink * aim.gain:
                return shrink
            bend = self._bend(aim, start, tried, shrink)
        return 0.0

    def _damped(self, aim: Aim, start: Point) -> None:
        """Goes by the first of the damped steps that gains enough, if that is better than where the climb stands."""
        before, most = self._total(start), self._total(self.point)
        for damping in DAMPED:
            move, gain = aim.quadratic.step(*self._room(start.vector), damping=damping)
            most = self._kept(self._at(start.vector + move), most)
            if most > before + ENOUGH * gain:
                break

    def _kept(self, tried: Point, most: float) -> float:
        """Goes to a point that is likelier than the likeliest so far; returns the log likelihood of the likeliest."""
        total = self._total(tried)
        if total > most:
            self.point = tried
        return max(total, most)

    def _bend(self, aim: Aim, start: Point, tried: Point, shrink: float) -> Array:
        """Returns the bend (k,) of the way along a step, from what a share of it has shown beside the slopes."""
        straight = aim.here.slope @ (tried.vector - start.vector)
        seen = (tried.white - start.white)[self.counts[start.whitening.run]]
        return aim.quadratic.bend(aim.here, 2.0 / shrink**2 * (seen - straight), aim.move, shrink)

    def _at(self, vector: Array) -> Point:
        clipped = np.clip(vector, self.low, self.high)
        model = model_of(clipped, self.free, base=self.point.model)
        at = residuals(self.evidence, model)
        if model.acting("shaking"):
            return self._whitened(clipped, model, at)
        return self._point(clipped, model, at, self.point.whitening)

    def _whitened(self, vector: Array, model: Model, at: dict[str, Array]) -> Point:
        whitening = Whitening(self.evidence, self.noise, shaking=shaking_of(self.evidence, model))
        return self._point(vector, model, at, whitening)

    def _point(self, vector: Array, model: Model, at: dict[str, Array], whitening: Whitening) -> Point:
        white = whitening(stack(self.evidence, at))
        return Point(vector, model, at, white, whitening, decays(self.evidence, model), self._plain_decay)

    def _total(self, at: Point) -> float:
        """Returns the log density of the runs that count, and of the numbers' priors."""
        counted = self.counts[at.whitening.run]
        prior = -0.5 * float(self.precision @ at.vector**2)
        return float(at.density[counted].sum() - at.whitening.log_scale[self.counts].sum()) + prior
