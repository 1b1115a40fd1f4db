"""Breakaways: the blocks' paths from rest under a law of sliding friction, and the likelihood of each moment of slip.

A block that is released when the pull passes mu_s per press slides with

    v' = pull − press mu_s (1 − D − F (1 − s(v / v_s))) − k v,

so that its friction may drop at once (D), fall with the speed (F over v_s; s is one of SHAPES), and have a drag (k). A
session's runs share everything but the moment of slip, which implies mu_s, and D, which is drawn anew for each run from
a Gaussian, since what a contact gained at rest is lost. The unknown place, the creep with the tilt before the slip, and
D's random effect are integrated out (they are linear), so that a run's frames leave a likelihood of the moment of slip
alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from station.diagnosis.observations.breakaway_marginal import log_likelihoods
from station.diagnosis.observations.breakaway_search import Sloped
from station.diagnosis.observations.breakaway_slopes import sloped
from station.diagnosis.observations.breakaway_tables import SPEEDS_M_S, STEP_S, Along, Laws, Rows, cubics
from station.diagnosis.observations.early import Early
from station.diagnosis.observations.first_look import Look
from station.diagnosis.observations.plate import Times
from station.physics.contact import Array

EDGE_S = 3 * STEP_S
WIDE_S, COUNT = 0.12, 31
"""The half width (s) and the number of the moments at which slips are first sought."""

NEAR_SIGMAS = 4.0
OUTLIER = 20.0
"""A run counts as an outlier if its log likelihood is lower than that of a path that a law fits by more than this."""

TRACE = 1e-3
"""A moment at which the plate holds has at least this share of the prior at the plate's fastest."""

Curve = Callable[[Array], Array]
"""A function of the speeds (n,) over v_s."""


@dataclass(frozen=True, slots=True)
class Shape:
    """A gentle fall: the share 1 − s of it that is reached at u = v / v_s, and the slope of that by ln u."""

    fallen: Curve
    slope: Curve


EXPONENTIAL, LORENTZIAN, LOGARITHM, GAUSSIAN = 0, 1, 2, 3
SHAPES: Mapping[int, Shape] = {
    EXPONENTIAL: Shape(lambda u: -np.expm1(-u), lambda u: u * np.exp(-u)),
    LORENTZIAN: Shape(lambda u: 1.0 - 1.0 / (1.0 + u * u), lambda u: 2.0 * u * u / np.square(1.0 + u * u)),
    LOGARITHM: Shape(np.log1p, lambda u: u / (1.0 + u)),
    GAUSSIAN: Shape(lambda u: -np.expm1(-u * u), lambda u: 2.0 * u * u * np.exp(-u * u)),
}

ALONG = ("drop", "fall", "fall_speed_m_s", "drag_per_s")
"""The numbers of a law that change its tables; slopes are by D, F, ln v_s and k."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Law:
    """The law that a session's slides share; see the module.

    `creep_m` is the standard deviation of a block's creep before it slips, per relative rise of the tilt's sine.
    """

    drop: float = 0.0
    drop_spread: float = 1e-4
    fall: float = 0.0
    fall_speed_m_s: float = 0.03
    drag_per_s: float = 0.0
    creep_m: float = 1e-5
    shape: int = EXPONENTIAL

    def of_runs(self, runs: int) -> Laws:
        """Returns the same law for each of `runs` runs."""
        return Laws(
            held=cubics(1.0 - self.drop - self.fall * self._fallen())[None],
            slowing_m_s2=cubics(self.drag_per_s * SPEEDS_M_S)[None],
            of_run=np.zeros(runs, dtype=np.int64),
            spread=self.drop_spread,
            creep_m=self.creep_m,
        )

    def along(self, names: Sequence[str]) -> Along:
        """Returns the slopes of its tables by these numbers, which are among ALONG."""
        nothing = np.zeros_like(SPEEDS_M_S)
        held = {"drop": nothing - 1.0, "fall": -self._fallen(), "fall_speed_m_s": self.fall * self._rising()}
        slowing = {"drag_per_s": SPEEDS_M_S}
        tables = np.array([[of.get(name, nothing) for name in names] for of in (held, slowing)])
        return Along(*cubics(tables)[:, :, None])

    def _fallen(self) -> Array:
        """Returns the share (COUNT,) of the fall that is reached at each of SPEEDS_M_S, 1 - s."""
        return SHAPES[self.shape].fallen(SPEEDS_M_S / self.fall_speed_m_s)

    def _rising(self) -> Array:
        """Returns the slope (COUNT,) of that share by -ln v_s."""
        return SHAPES[self.shape].slope(SPEEDS_M_S / self.fall_speed_m_s)


class Falling(Protocol):
    """An object that has the law of sliding of each run."""

    def of_runs(self, runs: int) -> Laws:
        """Returns the laws of `runs` runs."""
        ...


@dataclass(frozen=True, eq=False)
class Breakaways:
    """Runs (r,) with the moments of slip (r, k), s, that are tried, and the log prior of each one's friction."""

    runs: Sequence[Early]
    rows: Rows
    tried_s: Array
    log_expected: Array

    @classmethod
    def of(cls, seen: Sequence[tuple[Early, Look]]) -> Breakaways:
        """Builds it for runs (r,), with moments on both sides of the first look's."""
        runs, looks = [run for run, _ in seen], [look for _, look in seen]
        none = np.zeros((len(runs), 0))
        whole = cls(runs, _rows(runs, np.array([look.sigma_m for look in looks])), none, none)
        half_s = np.array([max(NEAR_SIGMAS * look.within_s, WIDE_S) for look in looks])
        return whole._trying(np.array([look.time_s for look in looks]), half_s, COUNT)

    def _trying(self, middle_s: Array, half_s: Array, count: int) -> Breakaways:
        """Returns the same runs with `count` moments within `half_s` (r,) of `middle_s` (r,)."""
        first = np.array([run.time_s[0] + EDGE_S for run in self.runs])
        last = np.array([run.time_s[-1] - EDGE_S for run in self.runs])
        begin = np.clip(middle_s - half_s, first, last - STEP_S)
        tried = np.linspace(begin, np.clip(middle_s + half_s, begin + STEP_S, last), count, axis=1)
        expected = [_expected(run, row) for run, row in zip(self.runs, tried, strict=True)]
        return replace(self, tried_s=tried, log_expected=np.log(np.array(expected)))

    def nearer(self, law: Falling, count: int) -> Breakaways:
        """Returns the same runs with `count` moments around those that a law makes likely."""
        chance, tried = self.chances(law), self.tried_s
        mean = (chance * tried).sum(axis=1)
        variance = (chance * (tried - mean[:, None]) ** 2).sum(axis=1) + (tried[:, 1] - tried[:, 0]) ** 2
        return self._trying(mean, np.maximum(NEAR_SIGMAS * np.sqrt(variance), STEP_S), count)

    def around(self, law: Falling, count: int) -> Breakaways:
        """Gives the same runs with `count` moments where a law puts the slips, sought twice, the first time widely."""
        return self.nearer(law, COUNT).nearer(law, count)

    def some(self, number: int) -> Breakaways:
        """Returns the runs thinned to `number` of them, evenly spaced; all of them if there are fewer."""
        return self.chosen(np.unique(np.linspace(0, len(self.runs) - 1, number).astype(int)))

    def chosen(self, indices: Times) -> Breakaways:
        """Returns the runs with the `indices` (m,) among these."""
        rows = Rows(*(part[indices] for part in self.rows))
        return Breakaways([self.runs[row] for row in indices], rows, self.tried_s[indices], self.log_expected[indices])

    def softened(self, times: float) -> Breakaways:
        """Returns the same runs with `times` the noise, so that a law far from the truth still has a slope to climb."""
        return replace(self, rows=self.rows._replace(sigma_m=times * self.rows.sigma_m))

    def turning_about(self, arm_m: Array) -> Breakaways:
        """Returns the same runs on a plate whose true pivot has the arm `arm_m` (3,), m in P, to the configured one."""
        runs = [run.turning_about(arm_m) for run in self.runs]
        expected = [_expected(run, row) for run, row in zip(runs, self.tried_s, strict=True)]
        return replace(self, runs=runs, rows=_rows(runs, self.rows.sigma_m), log_expected=np.log(np.array(expected)))

    def loaded(self, arm_m: Array) -> Breakaways:
        """Returns the same for the arm `arm_m` (3,), m in P, with the moments' prior as it is.

        An arm that is close by hardly changes it, and it is slow.
        """
        if self._swings is None:
            return self
        pull, press = self._swings @ np.array([1.0, *arm_m])
        return replace(self, rows=self.rows._replace(pull=pull, press=press))

    @cached_property
    def _swings(self) -> Array | None:
        """Pull and press by the configured pivot on the even grids, and what each metre of arm adds: (2, r, m, 4)."""
        known = [swing for run in self.runs if (swing := run.swing) is not None]
        if len(known) < len(self.runs):
            return None
        parts = [np.concatenate([swing.sliding[..., None], swing.per_m], axis=-1).T for swing in known]
        even = [[_even(self.runs, [part[k, :, side] for part in parts]) for k in range(4)] for side in range(2)]
        return np.moveaxis(np.array(even), 1, -1)

    def log_likelihoods(self, law: Falling) -> Array:
        """Returns the log likelihood (r, k) of each moment, with the log prior of the friction that it implies."""
        return log_likelihoods(self.tried_s, self.rows, law.of_runs(len(self.runs))) + self.log_expected

    def chances(self, law: Falling) -> Array:
        """Returns the probability (r, k) of each moment; those of a run sum to 1."""
        log = self.log_likelihoods(law)
        chance = np.exp(log - log.max(axis=1, keepdims=True))
        return chance / chance.sum(axis=1, keepdims=True)

    def log_likelihood(self, law: Falling) -> float:
        """Returns the session's log likelihood, the moments integrated out.

        A run that no law fits counts as an outlier.
        """
        return float(self.of_runs(law).sum())

    def of_runs(self, law: Falling) -> Array:
        """Returns the log likelihood (r,) of each run, see `log_likelihood`."""
        return self._of_runs(self.log_likelihoods(law))

    def _of_runs(self, log: Array) -> Array:
        """Returns the log likelihood (r,) of each run, from that of its moments (r, k)."""
        floor = -self.rows.count * (0.5 + np.log(self.rows.sigma_m)) - OUTLIER
        return np.logaddexp(np.logaddexp.reduce(log, axis=1), floor)

    def sloped(self, law: Falling, along: Along) -> Sloped:
        """Returns the log likelihood with its slopes by q + 2 numbers; see `breakaway_slopes`.

        The moment of slip, and whether a run is an outlier, are missing data: from the information of the complete data
        the variance of their slopes is subtracted (Louis 1982, J. R. Stat. Soc. B 44, 226, eq. 3.2).
        """
        found = sloped(self.tried_s, self.rows, law.of_runs(len(self.runs)), along)
        log = found.log + self.log_expected
        whole = self._of_runs(log)
        chance = np.exp(log - whole[:, None])
        slope = np.einsum("rk,rki->ri", chance, found.slope)
        known = np.einsum("rk,rkij->ij", chance, found.information)
        varied = np.einsum("rk,rki,rkj->ij", chance, found.slope, found.slope) - slope.T @ slope
        return Sloped(float(whole.sum()), slope.sum(axis=0), known, known - varied)


def _rows(runs: Sequence[Early], sigma_m: Array) -> Rows:
    return Rows(
        first_s=np.array([run.grid_s[0] for run in runs]),
        pull=_even(runs, [run.pull for run in runs]),
        press=_even(runs, [run.press for run in runs]),
        count=np.array([len(run.time_s) for run in runs]),
        time_s=_padded([run.time_s for run in runs]),
        path_m=_padded([run.path_m for run in runs]),
        sine=_padded([np.sin(np.interp(run.time_s, run.grid_s, run.plate_rad)) for run in runs]),
        sigma_m=sigma_m,
    )


def _even(runs: Sequence[Early], values: Sequence[Array]) -> Array:
    """Returns values on the runs' own grids (m,), at steps of STEP_S, padded: (r, n)."""
    grids = [np.arange(run.grid_s[0], run.grid_s[-1], STEP_S) for run in runs]
    return _padded([np.interp(grid, run.grid_s, each) for grid, run, each in zip(grids, runs, values, strict=True)])


def _padded(rows: Sequence[Array]) -> Array:
    """Returns rows of unequal lengths as (r, m), each continued by its last value."""
    longest = max(len(row) for row in rows)
    return np.array([np.concatenate([row, np.full(longest - len(row), row[-1])]) for row in rows])


def _expected(run: Early, tried_s: Array) -> Array:
    """Returns the relative range of friction that each moment (k,) stands for: almost none while the plate holds."""
    trace = TRACE * max(float(run.rise.max()), 1e-6)
    return (np.interp(tried_s, run.grid_s, run.rise) + trace) * float(tried_s[1] - tried_s[0])
