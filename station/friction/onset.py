"""The onset of a slide: the measured path, fitted back to the friction at which the block began to move.

A block at rest on a plate of tilt θ(t) moves along its slide, as soon as that pulls,

    x″ = c (g sin θ + θ′² d) − mu N,    N = g cos θ − θ″ d − 2 c θ′ x′,    x′ ≥ 0,

with c the cosine between the slide and the steepest line, and d how far the block lies down that line from the axis
about which the plate turns: a plate that turns faster and faster falls away from under its lower side, and its turning
pulls and lifts what moves outwards. What is integrated once is θ′ and no θ″, so that readings need not be smooth. Two
models are fitted. The plain slider has one friction, c tan θ0, at rest and sliding (its displacement grows as t³ on a
ramp): the angle θ0 alone is sought. With a kinetic friction that is lower (x grows as t²) the moment is sought, and mu
is linear; this model is taken only when the data demand it. A constant and a term in sin θ stand for the reference's
error and for a camera that sags.

A displacement threshold reads late (physics: 0.4° at 1°/s, 1.2° at 5°/s for 2 mm); this does not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from station.friction.onset_errors import Residuals
from station.friction.onset_loads import GRAVITY_M_S2, Array, Loads, tilt_sigma_rad
from station.friction.onset_repeats import Stretches, without_repeats

RULE = 3
"""Raised with every change of the onsets, errors or flags that the same messages give: recordings say by which theirs
were estimated, so that one of before is not taken for a forged one. 1: until residuals of the slide made its error; 2:
until the mark's own side did, where it contradicts the plate's scale, and what braked the block told of pushes."""
_COARSE = 60
_NEAR, _FINE = 3, 8
"""The fine grid: this many coarse cells to either side of the best point, each divided by that."""

_REFINE = 16
_ANGLES = 24
"""Angles of the plain slider's first look. A larger one has a shorter way at every moment, so χ² has one valley."""
_BEYOND_RAD = 0.01
"""An onset is sought so far beyond the steepest tilt: a plate that stops its turning lifts a block, by less."""
_SLIGHT_RAD = 1e-6
"""Half of the difference of two angles whose ways give the slope."""
_HELD_RAD = 1e-5
_SLIDE_CHI2 = 25.0  # less than 5 sigma of displacement: nothing moved
_FREE_KINETIC_GAIN = 12.0
"""Drop of χ² that the extra parameter must bring: about 3.5 standard deviations, as 1 run in 2000 would by chance."""

_LEAST_DROP = 0.05
"""A smaller drop to kinetic friction is not believed: measured ones are 10 % and more, and a micrometre of creep before
the slide looks like 1 %."""
LONGEST_S = 60.0
"""Readings that span more are of no one slide: what is fitted are the 3 s before its detection, on the rig and in an
imported track. Each second of them takes 0.9 MB in the fit, so that a wrong stamp of a file could ask for terabytes."""
WAY_SHARE = 0.002
"""The share of its way by which a slide may differ from the law, and the camera's scale from the true one, alike in all
frames of a slide. With it the angles of simulated samples scatter as is stated, without it four times as much
(`pytest tests/recovery/test_onset_errors.py`)."""


@dataclass(frozen=True, slots=True)
class Onset:
    """The moment (ns) and the tilt at which the slide began, with standard error, and the friction while sliding.

    The angle is the tilt that a plate at rest would have needed. Its error holds the noise of the corners, the jitter
    of their stamps and what else the residuals show of the model (`onset_errors`), and the errors of the way's scale
    (`WAY_SHARE`, and what the mark's side says otherwise), of the clocks and of the curve through the tilt's readings,
    but not of these; of readings that only repeat there is no trust (`onset_repeats`).
    """

    slip_ns: int
    angle_rad: float
    angle_sigma_rad: float
    kinetic_mu: float
    residual_m: float


_LONGEST_S = 3600.0
"""A slide and what leads to it last seconds or minutes; a stamp of hours later is none, and is not interpolated to."""


def _golden(score: Callable[[Array], Array], low: Array, high: Array) -> tuple[Array, Array]:
    """Returns the least of a function with one valley between two points: where, and how much.

    For several valleys, both are (k,).
    """
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
    clock_sigma_s: float = 0.0,
    scale_sigma: float = 0.0,
) -> Onset | None:
    """Fits the onset of one slide.

    Args:
        path_ns: times (n,) of the frames, from well before the slide to the detection.
        path_m: displacement (n,) along the slide's direction, metres.
        tilt_ns: times (m,) of the attitude readings, covering those of the path.
        tilt_rad: tilt (m,) against gravity.
        sigma_m: standard deviation of one displacement.
        along: cosine of the angle between the slide and the steepest line.
        ahead_m: how far the block lies down the steepest line from the axis about which the plate turns.
        clock_sigma_s: standard deviation of the times of the frames against those of the readings.
        scale_sigma: standard deviation of the path's scale, as a share of it, beside `WAY_SHARE`.

    Returns:
        The onset, or None when there are too few frames or no slide in them, the readings span over `LONGEST_S`, or a
            number is none.
    """
    frames, path = np.asarray(path_ns, dtype=np.int64), np.asarray(path_m, dtype=np.float64)
    times = np.asarray(tilt_ns, dtype=np.int64)
    tilt = np.asarray(tilt_rad, dtype=np.float64)
    ahead = np.isfinite(tilt) & (np.diff(np.maximum.accumulate(times), prepend=times[:1] - 1) > 0)
    times, tilt = times[ahead], tilt[ahead]
    numbers = np.isfinite(path).all() and math.isfinite(sigma_m * sigma_m)
    if len(frames) < 8 or len(times) < 4 or not numbers:
        return None
    origin = int(times[0])
    if int(times[-1]) - origin > LONGEST_S * 1e9:
        return None
    t = np.asarray((frames - origin) * 1e-9, dtype=np.float64)
    readings_s = np.asarray((times - origin) * 1e-9, dtype=np.float64)
    if readings_s[-1] > _LONGEST_S:
        return None
    mended, repeats = without_repeats(readings_s, tilt)
    loads = Loads(readings_s, mended, frames_s=t, ahead_m=ahead_m, way_m=along * path)
    fit = _Fit(t, path, loads, along=along, sigma_m=max(sigma_m, 1e-7), repeats=repeats)
    best = fit.best()
    if fit.without_slide() - best.chi2 < _SLIDE_CHI2:
        return None
    return Onset(
        slip_ns=origin + round(best.t0 * 1e9),
        angle_rad=best.angle_rad,
        angle_sigma_rad=float(
            np.hypot(
                fit.sigma_rad(best, clock_sigma_s=clock_sigma_s, scale_sigma=scale_sigma),
                tilt_sigma_rad(readings_s, tilt, best.t0),
            )
        ),
        kinetic_mu=best.mu_k,
        residual_m=float(np.sqrt(best.chi2 / len(t)) * fit.sigma_m),
    )


@dataclass(frozen=True, slots=True)
class _Best:
    """The slide that fits best: its moment (s), angle, kinetic friction and χ², and its model.

    `way` are its places at the frames (n,), and `slope` how they change with the angle (n,), m/rad, without what the
    nuisance explains.
    """

    t0: float
    angle_rad: float
    mu_k: float
    chi2: float
    way: Array
    slope: Array


class _Fit:
    """χ² of both models, everything linear solved: for many angles or t0 (…,) at once, as a fit tries hundreds."""

    def __init__(
        self, t: Array, path: Array, loads: Loads, *, along: float, sigma_m: float, repeats: Stretches
    ) -> None:
        self.t, self.path, self.loads, self.along, self.sigma_m = t, path, loads, along, sigma_m
        drift = np.sin(np.interp(t, loads.grid, loads.theta))
        # Without a change of tilt the sag cannot be told from the constant.
        nuisance = np.column_stack([np.ones_like(t), drift - drift.mean()][: 2 if np.ptp(drift) > 1e-3 else 1])
        self.basis, self.share = np.linalg.qr(nuisance)[0], np.ones(nuisance.shape[1])
        if len(repeats.begin_s):
            self._widen(along * repeats.ways_m(t) / sigma_m)

    def _widen(self, ways: Array) -> None:
        """Adds ways (n, k) to the covariance model, each of which the path may be off by, in standard deviations."""
        basis, size, _ = np.linalg.svd(self._clear(ways.T).T, full_matrices=False)
        self.basis = np.column_stack([self.basis, basis])
        self.share = np.append(self.share, 1.0 - 1.0 / np.sqrt(1.0 + size**2))

    def _clear(self, values: Array) -> Array:
        """Returns values (…, n) without the nuisance, and less of what is uncertain: only noise is left of errors."""
        return values - (values @ self.basis * self.share) @ self.basis.T

    def _chi2(self, residual: Array) -> Array:
        """Returns χ² (…,) of residuals (…, n)."""
        rest = self._clear(residual)
        return (rest * rest).sum(axis=-1) / self.sigma_m**2

    def without_slide(self) -> float:
        return float(self._chi2(self.path))

    def best(self) -> _Best:
        """Returns the slide by the model that the data support."""
        plain = self._plain()
        t0, chi2 = self._minimum(lambda at: self.free(at)[0])
        mu_k = float(self.free(t0)[1])
        drops = mu_k < (1.0 - _LEAST_DROP) * self.along * float(np.tan(self.loads.tilt(t0)))
        if drops and plain.chi2 - chi2 > _FREE_KINETIC_GAIN * max(1.0, chi2 / len(self.t)):
            return self._free(t0, mu_k, chi2)
        return plain

    # --- the plain slider ----------------------------------------------------------------------------------------

    def way(self, angle_rad: ArrayLike) -> Array:
        """Returns places (…, n), m, at the frames, of plain sliders with these friction angles (…,)."""
        loads = self.loads
        speed = loads.speed(self.along * np.tan(angle_rad), along=self.along)
        return loads.at_frames(loads.integral(speed))

    def _plain(self) -> _Best:
        """Looks at angles all over the range, by golden sections beside the best, then takes a step along the slope."""
        theta = self.loads.theta
        angles = np.linspace(float(theta.min()), float(theta.max()) + _BEYOND_RAD, _ANGLES)
        near = int(np.argmin(self._chi2(self.path - self.way(angles))))
        low, high = angles[max(near - 1, 0)], angles[min(near + 1, _ANGLES - 1)]
        found, _ = _golden(lambda at: self._chi2(self.path - self.way(at)), np.array([low]), np.array([high]))
        angle = float(found[0])
        for _ in range(2):
            slope = self._slope(angle)
            power = float(slope @ slope)
            angle += float(slope @ self._clear(self.path - self.way(angle))) / power if power > 0.0 else 0.0
        way = self.way(angle)
        chi2 = float(self._chi2(self.path - way))
        mu = self.along * float(np.tan(angle))
        return _Best(self.loads.begin(mu, along=self.along), angle, mu, chi2, way, self._slope(angle))

    def _slope(self, angle_rad: float) -> Array:
        less, more = self.way(np.array([angle_rad - _SLIGHT_RAD, angle_rad + _SLIGHT_RAD]))
        return self._clear((more - less) / (2 * _SLIGHT_RAD))

    # --- with a kinetic friction of its own ------------------------------------------------------------------------

    def free(self, t0: ArrayLike) -> tuple[Array, Array]:
        """Returns χ² and mu_k with mu_k free, below its value for the plain slider and not negative."""
        loads = self.loads
        residual, drag = self.path - self.along * loads.since(loads.drive, t0), loads.since(loads.press, t0)
        seen = -self._clear(drag)
        power = (seen * seen).sum(axis=-1)
        mu_k = np.where(power > 0, (seen * self._clear(residual)).sum(axis=-1) / np.where(power > 0, power, 1.0), 0.0)
        mu_k = np.minimum(np.maximum(mu_k, 0.0), self.along * np.tan(loads.tilt(t0)))
        return self._chi2(residual + mu_k[..., None] * drag), mu_k

    def _free(self, t0: float, mu_k: float, chi2: float) -> _Best:
        """Returns the slide from t0 on; its angle changes with t0 as fast as the plate tilts then."""
        loads, theta = self.loads, float(self.loads.tilt(t0))
        jump = GRAVITY_M_S2 * (self.along * np.sin(theta) - mu_k * np.cos(theta))
        drag, ramp = self._clear(loads.since(loads.press, t0)), self._clear(np.maximum(self.t - t0, 0.0))
        by_time = jump * (ramp - (ramp @ drag) / max(float(drag @ drag), 1e-24) * drag)
        sigma_t = min(self.sigma_m / max(float(np.linalg.norm(by_time)), 1e-9), 1.0)
        rate = 0.5 * abs(float(loads.tilt(t0 + sigma_t) - loads.tilt(t0 - sigma_t))) / sigma_t
        way = self.along * loads.since(loads.drive, t0) - mu_k * loads.since(loads.press, t0)
        return _Best(t0, loads.resting_tilt(t0), mu_k, chi2, way, by_time / max(rate, 1e-9))

    def _minimum(self, score: Callable[[Array], Array]) -> tuple[float, float]:
        """Searches a grid, a finer one around its best point, then by golden sections there.

        While the plate is held, χ² hardly depends on t0, so the best point may lie a whole hold away from a deep and
        narrow valley just before or after it: both ends of the hold are tried as well.
        """
        coarse = np.linspace(self.t[0], self.t[-1], _COARSE)
        near = int(np.argmin(score(coarse)))
        first, last = max(near - _NEAR, 0), min(near + _NEAR, _COARSE - 1)
        fine = np.linspace(coarse[first], coarse[last], (last - first) * _FINE + 1)
        best = int(np.argmin(score(fine)))
        tilts = np.interp(fine, self.loads.grid, self.loads.theta)
        held = np.flatnonzero(np.abs(tilts - tilts[best]) < _HELD_RAD)
        ends = np.array([best, held[0], held[-1]])
        t0, chi2 = _golden(score, fine[np.maximum(ends - 1, 0)], fine[np.minimum(ends + 1, len(fine) - 1)])
        least = int(np.argmin(chi2))
        return float(t0[least]), float(chi2[least])

    # --- its error ---------------------------------------------------------------------------------------------------

    def sigma_rad(self, best: _Best, *, clock_sigma_s: float, scale_sigma: float) -> float:
        """Returns the standard error of the angle.

        It is that of what each frame has anew, and of what all frames of a slide have alike.
        """
        length, speed = max(float(np.linalg.norm(best.slope)), 1e-9), np.gradient(best.way, self.t)
        way = math.hypot(WAY_SHARE, scale_sigma) * best.way
        alike = self._clear(np.stack([way, clock_sigma_s * speed])) @ best.slope / length
        residuals = Residuals(
            residual_m=self._clear(self.path - best.way),
            speed_m_s=speed,
            slope=best.slope,
            taken=np.minimum((best.slope / length) ** 2 + self.basis**2 @ self.share, 1.0),
            moving=self.t > best.t0,
        )
        return float(np.hypot(residuals.error_m(self.sigma_m), np.linalg.norm(alike)) / length)
