"""Fits a model to a session: Newton steps by the runs' scores, the true Hessian at the end, Laplace's evidence."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from shared.geometry import Array
from tests.spike import forward as f
from tests.spike.models import START, Model
from tests.spike.session import Session

STEP = 1e-30
SETTLED = 0.02
"""A fit has converged when a Newton step would gain less than this (nats)."""
LONGEST = 40
SHIFT_S = 1.6e-2
"""The moment about which a run is linearised moves this far at once."""


@dataclass(eq=False)
class Fit:
    """A fit: parameters, the log posterior density, its Hessian over the free ones, the evidence, and its doubts."""

    model: Model
    theta: Array
    slip: Array
    free: tuple[int, ...]
    value: float = -math.inf
    likelihood: float = -math.inf
    hessian: Array = field(default_factory=lambda: np.zeros((0, 0)))
    decrement: float = math.inf
    evidence: float = -math.inf
    told: Array = field(default_factory=lambda: np.zeros((0, 4)))
    newton: Array | None = None
    drop: float = 0.0

    @property
    def converged(self) -> bool:
        """Whether Newton would gain nothing more."""
        return self.decrement < SETTLED

    def sd(self, place: int) -> float:
        """A parameter's posterior standard deviation."""
        at = self.free.index(place)
        return math.sqrt(max(np.linalg.inv(self.hessian)[at, at], 0.0))


class Fitter:
    """Fits models to one session."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.told = np.zeros((len(session.fact), 4))
        self._out = np.zeros(len(session.fact), np.complex128)
        self.evaluations = 0

    def runs(self, theta: Array, slip: Array) -> Array:
        """ln p of each run (r,), complex."""
        s = self.session
        f.likelihoods(theta.astype(complex), s.fact, s.frame, s.first, s.plate, s.row, slip, self.told, self._out)
        self.evaluations += 1
        return self._out

    def value(self, fit: Fit, theta: Array) -> float:
        """The log posterior density."""
        value = float(self.runs(theta, fit.slip).real.sum()) + _prior(fit, theta)
        return value if math.isfinite(value) else -math.inf

    def scores(self, fit: Fit, theta: Array) -> tuple[Array, Array]:
        """The gradient (p,) of the log posterior density, and each run's scores (r, p): exact, by complex steps."""
        rows = np.empty((len(self.session.fact), len(fit.free)))
        for column, place in enumerate(fit.free):
            moved = theta.astype(complex)
            moved[place] += STEP * 1j
            rows[:, column] = self.runs(moved, fit.slip).imag / STEP
        return rows.sum(axis=0) + _prior_slope(fit, theta), rows

    def hessian(self, fit: Fit, theta: Array, sds: Array) -> Array:
        """Minus the second derivatives (p, p), by central differences of the exact gradient."""
        rows = []
        for column, place in enumerate(fit.free):
            step = 0.02 * sds[column]
            up, down = theta.copy(), theta.copy()
            up[place], down[place] = up[place] + step, down[place] - step
            rows.append((self.scores(fit, down)[0] - self.scores(fit, up)[0]) / (2 * step))
        h = np.array(rows)
        return 0.5 * (h + h.T)

    def climb(self, fit: Fit, longest: int = LONGEST) -> None:
        """Newton with the runs' scores for curvature, damped, until a step would gain nothing."""
        theta, free = fit.theta.copy(), list(fit.free)
        doubt = np.diag([1.0 / fit.model.priors[place].sd ** 2 for place in free])
        value, damping = self.value(fit, theta), 1e-3
        for _ in range(longest):
            slope, rows = self.scores(fit, theta)
            centred = rows - rows.mean(axis=0)
            curve = centred.T @ centred + doubt
            fit.decrement = 0.5 * float(slope @ np.linalg.solve(curve, slope))
            fit.hessian = curve
            if fit.decrement < SETTLED:
                break
            for _ in range(12):
                step = np.linalg.solve(curve + damping * np.diag(np.diag(curve)), slope)
                size = np.max(np.abs(step) * np.sqrt(np.diag(doubt)))
                trial = theta.copy()
                trial[free] += step * min(1.0, 2.0 / size)
                new = self.value(fit, trial)
                if new > value:
                    damping = max(damping * 0.2, 1e-6)
                    break
                damping = max(damping, 1e-3) * 5.0
            else:
                break
            gained, theta, value = new - value, trial, new
            if gained < 0.2 * SETTLED:
                break
        fit.theta, fit.value = theta, value
        self._conclude(fit)

    def settle(self, fit: Fit, rounds: int = 6) -> None:
        """Climbs and linearises anew in turn, until neither changes anything."""
        self.take_up(fit)
        for _ in range(rounds):
            before = fit.value
            self.linearise_anew(fit)
            if fit.decrement < SETTLED and abs(fit.value - before) < SETTLED:
                break
            self.climb(fit, 8)
        self._conclude(fit)
        fit.told = self.told.copy()

    def _conclude(self, fit: Fit) -> None:
        fit.likelihood = fit.value - _prior(fit, fit.theta)
        sign, size = np.linalg.slogdet(fit.hessian)
        fit.evidence = fit.value + 0.5 * len(fit.free) * math.log(2 * math.pi) - 0.5 * size if sign > 0 else -math.inf

    def polish(self, fit: Fit, rounds: int = 4) -> None:
        """Newton with the true Hessian; the evidence with it."""
        free = list(fit.free)
        for _ in range(rounds):
            sds = np.sqrt(np.diag(np.linalg.inv(fit.hessian)))
            fit.hessian = self.hessian(fit, fit.theta, sds)
            slope, _ = self.scores(fit, fit.theta)
            size, way = np.linalg.eigh(fit.hessian * np.outer(sds, sds))
            low = size.min()
            step = sds * (way @ ((way.T @ (sds * slope)) / np.maximum(np.abs(size), 0.1)))
            fit.decrement = 0.5 * float(slope @ step) if low > 0 else math.inf
            if fit.decrement < SETTLED:
                break
            for shrink in (1.0, 0.4, 0.1, 0.02):
                trial = fit.theta.copy()
                trial[free] += shrink * step
                new = self.value(fit, trial)
                if new > fit.value:
                    fit.theta, fit.value = trial, new
                    break
            else:
                break
        self.value(fit, fit.theta)
        self._conclude(fit)
        fit.told = self.told.copy()

    def linearise_anew(self, fit: Fit) -> float:
        """Moves the moments of slip to where the fit finds them, if it likes them there; the largest move (s).

        Where Newton makes it worse, the run stays linearised about its moment.
        """
        fact = self.session.fact
        slid = fact[:, 10] == 0
        self.runs(fit.theta, fit.slip)
        moved = fit.slip + np.clip(self.told[:, 0], -SHIFT_S, SHIFT_S) * slid
        fact[:, 21] = fit.theta[f.DROP]
        tried = []
        for slip, newton in ((fit.slip, 0.0), (fit.slip, 1.0), (moved, 0.0), (moved, 1.0)):
            fact[:, 20] = newton
            tried.append(self.runs(fit.theta, slip).real.copy())
        best = np.argmax(np.array(tried) + np.array([0.0, 0.3, 0.3, 0.6])[:, None], axis=0)
        slip = np.where(best >= 2, moved, fit.slip)
        fact[:, 20] = best % 2
        largest = float(np.max(np.abs(slip - fit.slip), initial=0.0))
        fit.slip, fit.newton, fit.drop = slip, fact[:, 20].copy(), float(fit.theta[f.DROP])
        fit.value = self.value(fit, fit.theta)
        return largest

    def look_for_slips(self, fit: Fit, reach_s: float = 0.06, step_s: float = 3e-3) -> None:
        """The best of many moments around the present ones: at jumps of the pull there are several good ones."""
        fact = self.session.fact
        fact[:, 20], fact[:, 21] = 0.0, fit.theta[f.DROP]
        slip, best = fit.slip.copy(), np.full(len(fit.slip), -np.inf)
        for off in np.append(np.arange(-reach_s, reach_s + 1e-9, step_s), 0.0):
            moved = fit.slip + off * (fact[:, 10] == 0)
            value = self.runs(fit.theta, moved).real
            better = value > best
            slip[better], best[better] = moved[better], value[better]
        fit.slip, fit.drop = slip, float(fit.theta[f.DROP])
        self.linearise_anew(fit)

    def take_up(self, fit: Fit) -> None:
        """Linearises the runs as a fit does."""
        if fit.newton is not None:
            self.session.fact[:, 20], self.session.fact[:, 21] = fit.newton, fit.drop


def begin(model: Model, theta: Array, slip: Array, base: Fit | None = None) -> Fit:
    """A fit that has not begun; linearised as the base is."""
    fit = Fit(model=model, theta=theta.copy(), slip=slip.copy(), free=tuple(sorted(model.priors)))
    if base is not None and base.newton is not None:
        fit.newton, fit.drop = base.newton.copy(), base.drop
    return fit


def start_of(session: Session) -> tuple[Array, Array]:
    """Typical parameters, and the moments of slip as recorded."""
    return START.copy(), session.fact[:, 0].copy()


def _prior(fit: Fit, theta: Array) -> float:
    return sum(
        -0.5 * ((theta[place] - prior.mean) / prior.sd) ** 2 - math.log(prior.sd) - 0.5 * math.log(2 * math.pi)
        for place, prior in fit.model.priors.items()
    )


def _prior_slope(fit: Fit, theta: Array) -> Array:
    return np.array([-(theta[p] - fit.model.priors[p].mean) / fit.model.priors[p].sd ** 2 for p in fit.free])
