"""Fourier series of ln mu over the slide's direction, and what maximum dissipation makes of them.

A block that slides in the direction phi is held back by h(phi) = mu(phi), in units of the normal force: h is the
support function of the limit curve (Goyal, Ruina and Papadopoulos 1991). A pull T e(delta) (T = tan of the tilt, delta
downhill) moves the block once max over phi of T cos(delta − phi) − h(phi) is 0, in the phi that attains it. With
l = ln h and p = dl/dphi that is, for a convex curve,

    delta = phi + arctan p(phi),        ln T = l(phi) + ln(1 + p(phi)²) / 2.

While it then slides the pull exceeds what holds it, by `1/ease − 1` of that; the same condition on the surplus force,
(T e(delta) − force) parallel to e(phi), gives delta = phi + arctan(ease p(phi)).
The curve is convex where 1 + p² + p′ = (h + h″) / h is not negative.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from station.friction.direction import Array

Complex = NDArray[np.complex128]
ORDER = 20
"""Highest order kept: an ellipse of 3 to 1 is then right to 0.01 %."""
ODD = (1, 3, 4)
"""Orders that a general curve has beside its ellipse: 1 is one-way friction; 3 and 4 are what neither has."""
STEEPEST = 1.4
"""ln of the largest ratio of an ellipse's axes (about 4 to 1) that is fitted."""
NEGLIGIBLE = 1e-9
"""Coefficients below this are left out."""
_TURNS = 40
_CLOSE = 1e-4
"""Once a step is this small (rad) the next would be its cube."""


@dataclass(frozen=True, eq=False, slots=True)
class Local:
    """ln h and its derivatives at some directions (n,): `log`, `slope` p, `bend` p′ and `jerk` p″."""

    log: Array
    slope: Array
    bend: Array
    jerk: Array

    def __add__(self, other: Local) -> Local:
        """Returns the product of two curves."""
        return Local(self.log + other.log, self.slope + other.slope, self.bend + other.bend, self.jerk + other.jerk)


def ellipse_series(stretch_cos: float, stretch_sin: float) -> Complex:
    """Returns the series (ORDER + 1,) of ln h of an ellipse with mu_1 mu_2 = 1, without its mean.

    Its coefficients a are those of ln h = Re sum a_k exp(−i k phi).

    The arguments are ln(mu_1/mu_2) times cosine and sine of twice the direction of mu_1. With rho = (mu_1 − mu_2) /
    (mu_1 + mu_2), ln h = const + sum over k of (−1)^(k+1) rho^k cos(2 k (phi − axis)) / k.
    """
    stretch = complex(stretch_cos, stretch_sin)
    size = abs(stretch)
    series = np.zeros(ORDER + 1, dtype=np.complex128)
    # tanh(x/2)/x is even in x: no axis is needed where there is no stretch.
    ratio = stretch * (math.tanh(size / 2) / size if size > 1e-9 else 0.5)
    k = np.arange(1, ORDER // 2 + 1)
    series[2::2] = -((-ratio) ** k) / k
    return series


class Evaluator:
    """Several series (ORDER + 1,) made ready to be evaluated at the same directions, many times."""

    def __init__(self, series: Sequence[Complex], *, derivatives: int = 4) -> None:
        stacked = np.array(series)
        self._order = np.flatnonzero((np.abs(stacked) > NEGLIGIBLE).any(axis=0))
        factors = stacked[None, :, self._order] * (_TURNED[:derivatives, self._order])[:, None, :]
        self._weights = np.concatenate([factors.real, factors.imag], axis=2).reshape(derivatives * len(series), -1)
        self._size = (derivatives, len(series))

    def __call__(self, phi: Array) -> Array:
        """Returns values and derivatives (derivatives, series, n) at the directions phi (n,)."""
        return (self._weights @ _waves(phi, self._order)).reshape(*self._size, len(phi))


_TURNED = np.power.outer(-1j * np.arange(ORDER + 1), np.arange(4)).T
"""The factors of a coefficient for each derivative (4, ORDER + 1)."""


def _waves(phi: Array, order: NDArray[np.intp]) -> Array:
    """Returns cosines, then sines, of each order (2 m, n), by multiplication.

    Trigonometry would take most of a fit's time.
    """
    z = np.exp(1j * phi)
    square = z * z
    powers = np.empty((len(order), len(phi)), dtype=np.complex128)
    # Orders are mostly even: those of an ellipse.
    last: dict[int, tuple[int, Complex]] = {0: (0, np.ones_like(z)), 1: (1, z)}
    for row, k in enumerate(order.tolist()):
        at, power = last[k % 2]
        while at < k:
            at, power = at + 2, power * square
        last[k % 2] = (at, power)
        powers[row] = power
    return np.concatenate([powers.real, powers.imag])


def evaluate(series: Complex, phi: ArrayLike) -> Local:
    """Returns a series (ORDER + 1,) at the directions phi (…,), rad."""
    angles = np.asarray(phi, dtype=np.float64)
    return Local(*Evaluator([series])(angles.ravel())[:, 0].reshape(4, *angles.shape))


def slide_direction(
    slopes: Callable[[Array], Array], pull_rad: Array, *, ease: float = 1.0, start_rad: Array | None = None
) -> Array:
    """Gives the direction phi (n,), rad, of a block that is pulled towards delta (n,): Halley's method, kept in bounds.

    Args:
        slopes: gives p, p′ and p″, (3, n), at directions (n,).
        pull_rad: delta (n,).
        ease: see above.
        start_rad: where to begin (n,).

    Returns:
        phi (n,). For a curve that is not convex it is some solution; there the fit is refused anyway.
    """
    low, high = pull_rad - math.pi / 2, pull_rad + math.pi / 2
    phi = np.clip(pull_rad if start_rad is None else start_rad, low, high)
    for _ in range(_TURNS):
        p, bend, jerk = slopes(phi)
        square = 1.0 + (ease * p) ** 2
        error = phi + np.arctan(ease * p) - pull_rad
        rise = 1.0 + ease * bend / square
        curl = ease * (jerk - 2.0 * ease**2 * p * bend**2 / square) / square
        low, high = np.where(error < 0, phi, low), np.where(error > 0, phi, high)
        below = 2.0 * rise**2 - error * curl
        step = phi - 2.0 * error * rise / np.where(below > 1e-3, below, np.inf)
        outside = (step < low) | (step > high) | (rise <= 0.02) | (below <= 1e-3)
        moved = np.where(outside, (low + high) / 2, step)
        done = float(np.abs(moved - phi).max(initial=0.0)) < _CLOSE
        phi = moved
        if done:
            break
    return phi


def convexity(local: Local) -> Array:
    """Returns (h + h″) / h (n,): not negative where the curve is convex."""
    return 1.0 + local.slope**2 + local.bend
