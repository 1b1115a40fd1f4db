"""The onset of a slide: the measured path, fitted back to the moment at which the block began to move.

A block that starts from rest at t0 on a plate of tilt θ(t) follows, along its slide,

    x″ = g (c sin θ(t) − mu_k cos θ(t)),    x(t0) = x′(t0) = 0,

with c the cosine between the slide and the steepest line. A plate that turns faster or slower about its middle also
presses a block that lies d down the slope less or more, by d θ″. Every term is a double time integral of the measured
tilt (that of d θ″ is d θ itself), so that only t0 is not linear. Two models are fitted: mu_k = c tan θ(t0) (the plain
slider, whose displacement grows as t³ on a ramp), and mu_k free below that (kinetic friction is lower, x grows as t²);
the second is taken only when the data demand it. A constant and a term in sin θ stand for the reference's error and for
a camera that sags.

A displacement threshold reads late (physics: 0.4° at 1°/s, 1.2° at 5°/s for 2 mm); this does not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
GRAVITY_M_S2 = 9.81
_COARSE = 60
_NEAR, _FINE = 3, 8
"""The fine grid: this many coarse cells to either side of the best point, each divided by that."""

_REFINE = 16
_HELD_RAD = 1e-5
_SLIDE_CHI2 = 25.0  # less than 5 sigma of displacement: nothing moved
_FREE_KINETIC_GAIN = 12.0
"""Drop of χ² that the extra parameter must bring: about 3.5 standard deviations, as 1 run in 2000 would by chance."""

_LEAST_DROP = 0.05
"""A smaller drop to kinetic friction is not believed: measured ones are 10 % and more, and a micrometre of creep before
the slide looks like 1 %."""


@dataclass(frozen=True, slots=True)
class Onset:
    """The moment (ns) and the tilt at which the slide began, with standard errors, and the friction while sliding."""

    slip_ns: int
    angle_rad: float
    angle_sigma_rad: float
    kinetic_mu: float
    residual_m: float


@dataclass(frozen=True, slots=True)
class _Twice:
    """A function's ∫ and ∫∫ on the grid, and its ∫∫ at the frames."""

    once: Array
    twice: Array
    at_frames: Array


class _Integrals:
    """∫ and ∫∫ of what drives and presses, on a fine grid of time, to be evaluated from any time to each frame's."""

    def __init__(self, tilt_s: Array, tilt_rad: Array, *, frames_s: Array, ahead_m: float) -> None:
        self.frames_s = frames_s
        self.readings_s, self.readings_rad = tilt_s, tilt_rad
        self.grid = np.linspace(tilt_s[0], tilt_s[-1], max(int((tilt_s[-1] - tilt_s[0]) * 1000), 16) + 1)
        # A straight line between two readings would lie beside an accelerating tilt by half a thousandth of a degree,
        # which is more than what the noise of a good camera does.
        slopes = np.gradient(tilt_rad, tilt_s)
        self.theta = hermite(tilt_s, tilt_rad, slopes, at=self.grid)
        step = self.grid[1] - self.grid[0]
        rate = np.gradient(self.theta, step)
        self.drive = self._twice(GRAVITY_M_S2 * np.sin(self.theta), step)
        # The plate falls away from under a block on its lower side while the tilt accelerates.
        lifted = (-ahead_m * rate, -ahead_m * self.theta)
        self.drag = self._twice(GRAVITY_M_S2 * np.cos(self.theta), step, beside=lifted)

    def _twice(self, values: Array, step: float, *, beside: tuple[Array, Array] | None = None) -> _Twice:
        """Integrals of values (n,) on the grid; `beside` are the ∫ and ∫∫ of what is known without integrating."""
        once = _integral(values, step)
        twice = _integral(once, step)
        if beside is not None:
            once, twice = once + beside[0], twice + beside[1]
        return _Twice(once, twice, np.interp(self.frames_s, self.grid, twice))

    def since(self, what: _Twice, t0: ArrayLike) -> Array:
        """∫∫ from each t0 (...) to each frame, (..., n); zero before t0."""
        start = np.asarray(t0, dtype=np.float64)[..., None]
        passed = self.frames_s - start
        from_start = np.interp(start, self.grid, what.twice) + passed * np.interp(start, self.grid, what.once)
        return np.where(passed > 0, what.at_frames - from_start, 0.0)

    def tilt(self, t: ArrayLike) -> Array:
        """θ (...), rad, at each t (...), s."""
        return np.interp(np.asarray(t, dtype=np.float64), self.grid, self.theta)

    def tilt_sigma_rad(self, t: float) -> float:
        """The error (rad) of the curve through the tilt's readings, from how abruptly that bends there.

        A corner midway between two readings changes the bend from nothing to half of its own, and is cut by half of
        that; where the bend changes little the curve is right.
        """
        k = int(np.clip(np.searchsorted(self.readings_s, t), 3, max(len(self.readings_s) - 3, 3)))
        jerks = np.diff(self.readings_rad[k - 3 : k + 3], 3)
        return float(np.abs(jerks).max(initial=0.0)) / 4


def hermite(x: Array, y: Array, slopes: Array, *, at: Array) -> Array:
    """The cubic Hermite curve through y (n,) with these slopes (n,) at rising x (n,), read off at points (m,).

    It is what `scipy.interpolate.CubicHermiteSpline` gives, bit for bit: to load that package takes a third of a
    second, which every command that measures would pay.
    """
    width, before = np.diff(x), slopes[:-1]
    chord = np.diff(y) / width
    bend = (before + slopes[1:] - 2 * chord) / width
    piece = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
    s = at - x[piece]
    square = s * s
    cubic, quadratic = (bend / width)[piece], ((chord - before) / width - bend)[piece]
    return y[piece] + before[piece] * s + quadratic * square + cubic * (square * s)


def _integral(values: Array, step: float) -> Array:
    return np.concatenate([[0.0], np.cumsum(0.5 * step * (values[1:] + values[:-1]))])


def _golden(score: Callable[[Array], Array], low: Array, high: Array) -> tuple[Array, Array]:
    """The least of a function with one valley between two points: where, and how much; for several valleys, (k,)."""
    golden = 0.5 * (5.0**0.5 - 1.0)
    left, right = high - golden * (high - low), low + golden * (high - low)
    at_left, at_right = score(left), score(right)
    for _ in range(_REFINE):
        down = at_left < at_right
        low, high = np.where(down, low, left), np.where(down, right, high)
        new = np.where(down, high - golden * (high - low), low + golden * (high - low))
        at_new = score(new)
        left, right = np.where(down, new, right), np.where(down, left, new)
        at_left, at_right = np.where(down, at_new, at_right), np.where(down, at_left, at_new)
    return np.where(at_left < at_right, left, right), np.minimum(at_left, at_right)


def estimate_onset(
    path_ns: ArrayLike,
    path_m: ArrayLike,
    *,
    tilt_ns: ArrayLike,
    tilt_rad: ArrayLike,
    sigma_m: float,
    along: float = 1.0,
    ahead_m: float = 0.0,
) -> Onset | None:
    """Fits the onset of one slide.

    Args:
        path_ns: times (n) of the frames, from well before the slide to the detection.
        path_m: displacement (n) along the slide's direction, metres.
        tilt_ns: times (m) of the attitude readings, covering those of the path.
        tilt_rad: tilt (m) against gravity.
        sigma_m: standard deviation of one displacement.
        along: cosine of the angle between the slide and the steepest line.
        ahead_m: how far the block lies down the steepest line from the axis about which the plate turns.

    Returns:
        The onset, or None when there are too few frames or no slide in them.
    """
    frames, path = np.asarray(path_ns, dtype=np.int64), np.asarray(path_m, dtype=np.float64)
    times = np.asarray(tilt_ns, dtype=np.int64)
    tilt = np.asarray(tilt_rad, dtype=np.float64)
    ahead = np.isfinite(tilt) & (np.diff(np.maximum.accumulate(times), prepend=times[:1] - 1) > 0)
    times, tilt = times[ahead], tilt[ahead]
    if len(frames) < 8 or len(times) < 4 or not np.isfinite(path).all():
        return None
    origin = int(times[0])
    t = np.asarray((frames - origin) * 1e-9, dtype=np.float64)
    integrals = _Integrals(np.asarray((times - origin) * 1e-9, dtype=np.float64), tilt, frames_s=t, ahead_m=ahead_m)
    fit = _Fit(t, path, integrals, along=along, sigma_m=max(sigma_m, 1e-7))
    t0, mu_k, chi2, plain = fit.best()
    if fit.without_slide() - chi2 < _SLIDE_CHI2:
        return None
    scatter = float(np.sqrt(max(1.0, chi2 / max(len(t) - 4, 1))))
    sigma = fit.plain_sigma_rad(t0) if plain else fit.free_sigma_rad(t0, mu_k)
    return Onset(
        slip_ns=origin + round(t0 * 1e9),
        angle_rad=float(integrals.tilt(t0)),
        angle_sigma_rad=float(np.hypot(scatter * sigma, integrals.tilt_sigma_rad(t0))),
        kinetic_mu=mu_k,
        residual_m=float(np.sqrt(chi2 / len(t)) * fit.sigma_m),
    )


class _Fit:
    """χ² as a function of t0, everything else solved linearly: for many t0 (...) at once, as a fit tries hundreds."""

    def __init__(self, t: Array, path: Array, integrals: _Integrals, *, along: float, sigma_m: float) -> None:
        self.t, self.path, self.integrals, self.along, self.sigma_m = t, path, integrals, along, sigma_m
        drift = np.sin(np.interp(t, integrals.grid, integrals.theta))
        # Without a change of tilt the sag cannot be told from the constant.
        self.nuisance = np.column_stack([np.ones_like(t), drift - drift.mean()][: 2 if np.ptp(drift) > 1e-3 else 1])
        self.basis = np.linalg.qr(self.nuisance)[0]

    def _chi2(self, residual: Array) -> Array:
        """χ² (...) of residuals (..., n), what the nuisance explains taken out."""
        rest = residual - (residual @ self.basis) @ self.basis.T
        return (rest * rest).sum(axis=-1) / self.sigma_m**2

    def without_slide(self) -> float:
        return float(self._chi2(self.path))

    def plain_mu(self, t0: ArrayLike) -> Array:
        """The plain slider's mu_k = c tan θ(t0)."""
        return self.along * np.tan(self.integrals.tilt(t0))

    def _undriven(self, t0: ArrayLike) -> tuple[Array, Array]:
        """The path less what gravity drives, and ∫∫ of the drag; both (..., n)."""
        integrals = self.integrals
        return self.path - self.along * integrals.since(integrals.drive, t0), integrals.since(integrals.drag, t0)

    def plain(self, t0: ArrayLike) -> Array:
        """χ² with mu_k = c tan θ(t0)."""
        residual, drag = self._undriven(t0)
        return self._chi2(residual + self.plain_mu(t0)[..., None] * drag)

    def free(self, t0: ArrayLike) -> tuple[Array, Array]:
        """χ² and mu_k with mu_k free, below its value for the plain slider and not negative."""
        residual, drag = self._undriven(t0)
        seen = (drag @ self.basis) @ self.basis.T - drag
        power = (seen * seen).sum(axis=-1)
        mu_k = np.where(power > 0, (seen * residual).sum(axis=-1) / np.where(power > 0, power, 1.0), 0.0)
        mu_k = np.minimum(np.maximum(mu_k, 0.0), self.plain_mu(t0))
        return self._chi2(residual + mu_k[..., None] * drag), mu_k

    def best(self) -> tuple[float, float, float, bool]:
        """t0, mu_k, χ² of the model that the data support, and whether it is the plain one."""
        t0, chi2 = self._minimum(self.plain)
        free_t0, free_chi2 = self._minimum(lambda at: self.free(at)[0])
        mu_k = float(self.free(free_t0)[1])
        drops = mu_k < (1.0 - _LEAST_DROP) * float(self.plain_mu(free_t0))
        if drops and chi2 - free_chi2 > _FREE_KINETIC_GAIN * max(1.0, free_chi2 / len(self.t)):
            return free_t0, mu_k, free_chi2, False
        return t0, float(self.plain_mu(t0)), chi2, True

    def _minimum(self, score: Callable[[Array], Array]) -> tuple[float, float]:
        """A grid, a finer one around its best point, then golden sections there.

        While the plate is held, χ² hardly depends on t0, so the best point may lie a whole hold away from a deep and
        narrow valley just before or after it: both ends of the hold are tried as well.
        """
        coarse = np.linspace(self.t[0], self.t[-1], _COARSE)
        near = int(np.argmin(score(coarse)))
        first, last = max(near - _NEAR, 0), min(near + _NEAR, _COARSE - 1)
        fine = np.linspace(coarse[first], coarse[last], (last - first) * _FINE + 1)
        best = int(np.argmin(score(fine)))
        tilts = np.interp(fine, self.integrals.grid, self.integrals.theta)
        held = np.flatnonzero(np.abs(tilts - tilts[best]) < _HELD_RAD)
        ends = np.array([best, held[0], held[-1]])
        t0, chi2 = _golden(score, fine[np.maximum(ends - 1, 0)], fine[np.minimum(ends + 1, len(fine) - 1)])
        least = int(np.argmin(chi2))
        return float(t0[least]), float(chi2[least])

    def plain_sigma_rad(self, t0: float) -> float:
        """Standard error of the onset angle of the plain model.

        The acceleration is zero at t0, so x depends on t0 only through mu_k: dx/dθ = −c (1 + tan² θ) ∫∫ g cos θ.
        """
        slope = self.integrals.since(self.integrals.drag, t0)
        slope = self.along * (1.0 + float(np.tan(self.integrals.tilt(t0))) ** 2) * self._free_of(slope, self.basis)
        return self.sigma_m / max(float(np.linalg.norm(slope)), 1e-9)

    def free_sigma_rad(self, t0: float, mu_k: float) -> float:
        """Standard error of the onset angle with mu_k free: that of t0, times how fast the plate tilted then."""
        theta = float(self.integrals.tilt(t0))
        jump = GRAVITY_M_S2 * (self.along * np.sin(theta) - mu_k * np.cos(theta))
        drag = self._free_of(self.integrals.since(self.integrals.drag, t0), self.basis)
        both = np.column_stack([self.basis, drag / max(float(np.linalg.norm(drag)), 1e-12)])
        slope = jump * self._free_of(np.maximum(self.t - t0, 0.0), both)
        sigma_t = min(self.sigma_m / max(float(np.linalg.norm(slope)), 1e-9), 1.0)
        return 0.5 * abs(float(self.integrals.tilt(t0 + sigma_t) - self.integrals.tilt(t0 - sigma_t)))

    @staticmethod
    def _free_of(values: Array, basis: Array) -> Array:
        return values - basis @ (basis.T @ values)
