"""A first estimate of when a slide began, with a kinetic friction of its own, above or below the static one.

In the first millimetres x(t) = c + ∫∫ (pull − mu press) − k ∫ x from t0 on; all but t0 is linear. Let t_k be when the
pull passes mu: a block that starts at t0 > t_k lacks the speed V = ∫ (pull − mu press) from t_k to t0, to first order
the only trace of t0. V is linear, and as often negative as positive where mu is the static friction as well: its mean
over a session shows whether its slides are plain, and so does the mean of k.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from station.diagnosis.observations.early import AFTER_S, BEFORE_S, GRID_S, LEAST_FRAMES, Early
from station.physics.contact import Array

COARSE, FINE = 34, 13
DRAG_PER_S = 3.0
"""Prior standard deviation of k."""


@dataclass(frozen=True, slots=True)
class Look:
    """The estimated start of a slide, s from the rig's reading, and its error; V and k in their standard errors.

    `drag_per_s` is k, and `sigma_m` the noise that the path shows under the best such law.
    """

    time_s: float
    within_s: float
    lacking: float
    slowing: float
    drag_per_s: float
    sigma_m: float


def first_look(run: Early) -> Look | None:
    """Returns the first estimate of a run's slip; None if nothing fits."""
    paths = _Paths(run)
    near = np.linspace(-BEFORE_S, AFTER_S, COARSE)
    near = near[(near > run.time_s[0]) & (near < run.time_s[-LEAST_FRAMES])]
    first = paths.best(near) if len(near) > 2 else None
    if first is None:
        return None
    pitch = near[1] - near[0]
    return _read(paths, *(paths.best(np.linspace(first[0] - pitch, first[0] + pitch, FINE)) or first))


class _Paths:
    """Fits of a run's path with given moments of slip."""

    def __init__(self, run: Early) -> None:
        self.run = run
        self._twice = [self._integrated(values) for values in (run.pull, run.press)]

    def _integrated(self, values: Array) -> tuple[Array, Array, Array]:
        """Returns the integral and the double integral on the grid (m,), and the latter at the frames (n,)."""
        once = np.concatenate([[0.0], np.cumsum(0.5 * GRID_S * (values[1:] + values[:-1]))])
        twice = np.concatenate([[0.0], np.cumsum(0.5 * GRID_S * (once[1:] + once[:-1]))])
        return once, twice, np.interp(self.run.time_s, self.run.grid_s, twice)

    def best(self, tried: Array) -> tuple[float, float] | None:
        """Returns the likeliest of times (k,) at which the block is pulled forwards, with its slide's mu.

        It is None without any.
        """
        best: tuple[float, float, float] | None = None
        for t0 in tried.tolist():
            chi2, solved, _ = self.fit(t0)
            pulled = self.run.at(self.run.pull, t0) >= solved[0] * self.run.at(self.run.press, t0)
            if pulled and (best is None or chi2 < best[0]):
                best = (chi2, t0, float(solved[0]))
        return None if best is None else best[1:]

    def fit(self, t0: float, *, late: bool = False) -> tuple[float, Array, Array]:
        """Returns χ² of a slide from t0, its numbers (mu, k, c, with `late` the lacking speed) and their covariance."""
        run = self.run
        since = np.maximum(run.time_s - t0, 0.0)
        drive, drag = (self._since(part, t0, since) for part in self._twice)
        slowed = np.cumsum(np.where(since > 0, run.path_m, 0.0)) * (run.time_s[-1] - run.time_s[0])
        slowed *= DRAG_PER_S / (len(since) - 1)
        columns = [-drag, -slowed, np.ones_like(since), *([-since] if late else [])]
        table = np.column_stack(columns) / run.sigma_m
        value = (run.path_m - drive) / run.sigma_m
        normal = table.T @ table
        normal[1, 1] += 1.0
        inverse: Array = np.asarray(np.linalg.inv(normal + 1e-12 * np.diag(np.diag(normal))), dtype=np.float64)
        solved = inverse @ (table.T @ value)
        left = value - table @ solved
        return float(left @ left + solved[1] ** 2), solved, inverse

    def _since(self, part: tuple[Array, Array, Array], t0: float, since: Array) -> Array:
        """Returns the double integral (n,) from t0 to each frame."""
        once, twice, at_frames = part
        return np.where(since > 0, at_frames - self.run.at(twice, t0) - since * self.run.at(once, t0), 0.0)


def _read(paths: _Paths, t0: float, mu: float) -> Look:
    """Returns the estimate of a slide, with the time at which the lacking speed V would be reached.

    For a negative V that time lies before t_k; to clip V at 0 would delay it.
    """
    run = paths.run
    excess = run.pull - mu * run.press
    before = np.flatnonzero((run.grid_s <= t0) & (excess <= 0))
    start = int(before[-1]) if len(before) else 0
    gained = np.concatenate([[0.0], np.cumsum(np.maximum(excess[start:], 0.0))[:-1]]) * GRID_S
    chi2, solved, inverse = paths.fit(t0, late=True)
    wider = max(1.0, chi2 / max(len(run.time_s) - 5, 1))
    sigma = float(np.sqrt(inverse[-1, -1] * wider))
    lacking = float(np.interp(t0, run.grid_s[start:], gained) + solved[-1])
    passed = run.grid_s[start:] - run.grid_s[start]

    def passed_at(speed: float) -> float:
        """Returns the time from t_k until the speed is reached."""
        return float(np.interp(speed, gained, passed))

    within = passed_at(abs(lacking) + sigma) - passed_at(max(abs(lacking) - sigma, 0.0))
    apart = float(np.copysign(passed_at(abs(lacking)), lacking))
    # k is shrunk by its prior, and divided by the standard deviation that it then has.
    drag, variance = float(solved[1]), float(inverse[1, 1])
    slowing = drag / math.sqrt(max(variance * (1.0 - variance), 1e-9))
    return Look(
        time_s=float(run.grid_s[start] + apart),
        within_s=max(within, GRID_S),
        lacking=lacking / max(sigma, 1e-9),
        slowing=slowing,
        drag_per_s=DRAG_PER_S * drag,
        sigma_m=run.sigma_m * math.sqrt(wider),
    )
