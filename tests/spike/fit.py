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
SPACING, NARROWEST_S, WIDEST_S = 0.75, 2e-4, 8e-3
"""A cell of the moment of slip in its posterior standard deviations; its bounds."""
LIGHTEST = 1e-3
"""Cells with a smaller share of a run's likelihood are left out until its slip is looked for again."""


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
    cells: tuple[Array, Array] | None = None

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
        self.told = np.zeros((len(session.fact), 7))
        self.keep = np.ones((len(session.fact), f.CELLS), np.bool_)
        self.weight = np.zeros((len(session.fact), f.CELLS))
        self._out = np.zeros(len(session.fact), np.complex128)
        self.evaluations = 0

    def runs(self, theta: Array, slip: Array) -> Array:
        """ln p of each run (r,), complex."""
        s = self.session
        f.likelihoods(
            theta.astype(complex),
            s.fact,
            s.frame,
            s.first,
            s.plate,
            s.row,
            slip,
            self.keep,
            self.weight,
            self.told,
            self._out,
        )
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

    def settle(self, fit: Fit, rounds: int = 4) -> None:
        """Climbs and linearises anew in turn, until neither changes anything."""
        self.take_up(fit)
        for _ in range(rounds):
            before = fit.value
            self.look_again(fit)
            if fit.decrement < SETTLED and abs(fit.value - before) < SETTLED:
                break
            self.climb(fit, 6)
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

    def look_again(self, fit: Fit) -> None:
        """Puts the cells of each run where its slip may have been, and keeps those that may matter."""
        fact = self.session.fact
        self.keep[:] = True
        self.runs(fit.theta, fit.slip)
        fit.slip = fit.slip + self.told[:, 0] * (fact[:, 10] == 0)
        # The 11 cells hold ± 4 standard deviations; Sheppard's correction undoes the cells' own.
        sd = np.sqrt(np.maximum(self.told[:, 1] ** 2 - fact[:, 20] ** 2 / 3, (0.25 * fact[:, 20]) ** 2))
        fact[:, 20], fact[:, 21] = np.clip(SPACING * sd, NARROWEST_S, WIDEST_S), fit.theta[f.DROP]
        self.runs(fit.theta, fit.slip)
        self.keep[:] = self.weight > LIGHTEST
        fit.cells, fit.value = (fact[:, 20:22].copy(), self.keep.copy()), self.value(fit, fit.theta)

    def look_wide(self, fit: Fit) -> None:
        """Looks for the slips from far, nearer and nearer."""
        self.session.fact[:, 20], self.session.fact[:, 21] = WIDEST_S, fit.theta[f.DROP]
        for _ in range(3):
            self.look_again(fit)

    def take_up(self, fit: Fit) -> None:
        """Takes a fit's cells."""
        if fit.cells is not None:
            self.session.fact[:, 20:22], self.keep[:] = fit.cells


def begin(model: Model, theta: Array, slip: Array, base: Fit | None = None) -> Fit:
    """A fit that has not begun; its cells are the base's."""
    fit = Fit(model=model, theta=theta.copy(), slip=slip.copy(), free=tuple(sorted(model.priors)))
    fit.cells = base.cells if base is not None else None
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
