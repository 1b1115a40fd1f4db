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
from collections.abc import Callable
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
_TURNS = 30


@dataclass(frozen=True, eq=False, slots=True)
class Local:
    """ln h and its derivatives at some directions (n): `log`, `slope` p, `bend` p′ and `jerk` p″."""

    log: Array
    slope: Array
    bend: Array
    jerk: Array

    def __add__(self, other: Local) -> Local:
        """The product of two curves."""
        return Local(self.log + other.log, self.slope + other.slope, self.bend + other.bend, self.jerk + other.jerk)


def ellipse_series(stretch_cos: float, stretch_sin: float) -> Complex:
    """Coefficients a (ORDER + 1) of ln h = Re sum a_k exp(−i k phi) of an ellipse with mu_1 mu_2 = 1, less their mean.

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


def evaluate(series: Complex, phi: ArrayLike) -> Local:
    """A series (ORDER + 1) at the directions phi (n), by Horner's rule."""
    z = np.exp(-1j * np.asarray(phi, dtype=np.float64))
    used = np.flatnonzero(series)
    last = int(used[-1]) if len(used) else 0
    order = np.arange(last + 1)
    rows = series[: last + 1] * np.array([np.ones(last + 1), -1j * order, -(order**2), 1j * order**3])
    sums = [_horner(row, z, even=not series[1::2].any()) for row in rows]
    return Local(*(total.real for total in sums))


def _horner(row: Complex, z: Complex, *, even: bool) -> Complex:
    if even:
        row, z = row[::2], z * z
    total = np.full(z.shape, row[-1])
    for coefficient in row[-2::-1]:
        total = total * z + coefficient
    return total


def slide_direction(
    at: Callable[[Array], Local], pull_rad: ArrayLike, *, ease: float = 1.0, start_rad: Array | None = None
) -> Array:
    """The direction phi (n) in which a block slides that is pulled towards delta (n): Newton's method, kept in bounds.

    For a curve that is not convex some solution; there the fit is refused anyway.
    """
    pull = np.asarray(pull_rad, dtype=np.float64)
    low, high = pull - math.pi / 2, pull + math.pi / 2
    phi = np.clip(pull if start_rad is None else start_rad, low, high)
    for _ in range(_TURNS):
        local = at(phi)
        eased = ease * local.slope
        error = phi + np.arctan(eased) - pull
        if np.abs(error).max(initial=0.0) < 1e-10:
            break
        low, high = np.where(error < 0, phi, low), np.where(error > 0, phi, high)
        rise = 1.0 + ease * local.bend / (1.0 + eased**2)
        step = phi - error / np.where(rise > 0.02, rise, np.inf)
        outside = (step <= low) | (step >= high) | (rise <= 0.02)
        phi = np.where(outside, (low + high) / 2, step)
    return phi


def convexity(local: Local) -> Array:
    """(h + h″) / h (n): not negative where the curve is convex."""
    return 1.0 + local.slope**2 + local.bend
