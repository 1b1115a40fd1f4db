"""The quadratic model of a log likelihood around a point, its maximum within bounds, and how its valley bends."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear

from station.diagnosis.inference.errors import Curvature
from station.physics.contact import Array

BENT = 0.75
"""The longest bend of a step, in lengths of the step: the alpha of Transtrum & Sethna."""

RIDGE, FLAT = 1e-9, 1e-6
"""The additions to the curvature by each number: a share of it, so that no two numbers are exactly one, and a prior of
a thousand typical sizes for what no row determines. A share of the largest curvature stood here: of a simulation
without noise it was a prior of half a typical size for all others, and a fit did not end within 25 steps
(`pytest tests/unit/diagnosis/test_climb.py`)."""


@dataclass(frozen=True, eq=False)
class Quadratic:
    """Minus the log likelihood around a point: its gradient (k,) and its hessian (k, k) by Gauss and Newton."""

    gradient: Array
    hessian: Array

    @staticmethod
    def of(here: Curvature, vector: Array, precision: Array, owed_slope: Array | float = 0.0) -> Quadratic:
        """Builds it at the numbers `vector` (k,), from the data and priors about 0, whose `precision` is (k,).

        What rows owe to their own motion has the slopes `owed_slope` (k,), see `likelihood.feedback`.
        """
        hessian = (here.slope * here.curve[:, None]).T @ here.slope + np.diag(precision)
        return Quadratic(here.slope.T @ here.pull + precision * vector - owed_slope, hessian)

    def step(self, least: Array, most: Array, *, damping: float = 0.0) -> tuple[Array, float]:
        """Returns the step (k,) to the maximum between the bounds `least` (k,) and `most` (k,), and the gain promised.

        With `damping` the step is that of a curvature to which this share of each number's own is added (Marquardt
        1963, J. SIAM 11, 431): what is told badly moves less.

        A Newton step that is merely clipped at the bounds can lead downhill: a number that is held at its bound changes
        the others' optimum (Stark & Parker 1995, Comput. Stat. 10, 129: bounded-variable least squares).
        """
        root = self._rooted(damping)
        target = -solve_triangular(root, self.gradient, lower=True)
        found = lsq_linear(root.T, target, (least, most), method="bvls")
        move = np.clip(np.asarray(found.x, dtype=np.float64), least, most)
        return move, -float(self.gradient @ move + 0.5 * move @ self.hessian @ move)

    def bend(self, here: Curvature, bent: Array, move: Array, shrink: float) -> Array:
        """Gives the second derivative (k,) of the way on a valley's floor, by that of the residuals.

        Where the step is to go by the share `shrink` of `move`, a bend longer than BENT of that way is shortened: the
        residuals are no quadratic so far away. Transtrum & Sethna 2012, arXiv:1201.5885 ("geodesic acceleration").

        Args:
            here: the curvature of the likelihood here.
            bent: (n,) the second derivative of the residuals along `move`, whitened.
            move: (k,) the step of the numbers.
            shrink: the share of `move` by which the step is to go.
        """
        root = self._root
        half = solve_triangular(root, here.slope.T @ (here.curve * bent), lower=True)
        bend = -solve_triangular(root.T, half)
        longest = 2.0 * BENT / shrink * float(np.linalg.norm(move))
        return bend * min(1.0, longest / max(float(np.linalg.norm(bend)), 1e-300))

    @cached_property
    def _root(self) -> Array:
        """The Cholesky factor (k, k) of the hessian with its ridge."""
        return self._rooted(0.0)

    def _rooted(self, damping: float) -> Array:
        """Returns the Cholesky factor (k, k) of the hessian with its ridge, and a further share of its diagonal."""
        diagonal = np.diag(self.hessian)
        return np.asarray(
            np.linalg.cholesky(self.hessian + np.diag((RIDGE + damping) * diagonal + FLAT)), dtype=np.float64
        )
