"""The loads of a block on a tilting plate along its slide: what drives and what presses it, integrated over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
GRAVITY_M_S2 = 9.81
AROUND_S = 0.03
"""A plate's acceleration is that of its tilt's readings within this time: over less it is mostly their noise."""
LEAST_READINGS = 5
SURE = 2.0
"""An acceleration of so many standard errors or less is taken for the readings' noise (of which 5 % are larger)."""


@dataclass(frozen=True, slots=True)
class Twice:
    """A function's ∫ and ∫∫ on the grid, and its ∫∫ at the frames."""

    once: Array
    twice: Array
    at_frames: Array


class Loads:
    """∫ and ∫∫ of what drives and presses, on a fine grid of time, to be evaluated from any time to each frame's.

    `drive` is g sin θ + θ′² d, `press` g cos θ − θ″ d − 2 θ′ d′, with d (m) how far the block lies down the steepest
    line from the axis of the turning.
    """

    def __init__(self, tilt_s: Array, tilt_rad: Array, *, frames_s: Array, ahead_m: float, way_m: Array) -> None:
        """Takes the tilt's readings (m,), how far the block lies ahead, m, and its way from there (n,) in frames."""
        self.frames_s = frames_s
        self.readings_s, self.readings_rad = tilt_s, tilt_rad
        self.grid = np.linspace(tilt_s[0], tilt_s[-1], max(int((tilt_s[-1] - tilt_s[0]) * 1000), 16) + 1)
        self.step_s = float(self.grid[1] - self.grid[0])
        # A straight line between two readings would lie beside an accelerating tilt by half a thousandth of a degree,
        # which is more than what the noise of a good camera does.
        self.theta = hermite(tilt_s, tilt_rad, np.gradient(tilt_rad, tilt_s), at=self.grid)
        self.rate, self.ahead_m = np.gradient(self.theta, self.step_s), ahead_m
        rate, ahead = self.rate, np.interp(self.grid, frames_s, ahead_m + way_m)
        self.drive = self._twice(self.integral(GRAVITY_M_S2 * np.sin(self.theta) + rate * rate * ahead))
        # θ″ d + 2 θ′ d′ = (θ′ d)′ + θ′ d′: the tilt need not be differentiated twice.
        lifted = rate * ahead + np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(ahead))])
        self.press = self._twice(self.integral(GRAVITY_M_S2 * np.cos(self.theta)) - lifted)

    def _twice(self, once: Array) -> Twice:
        twice = self.integral(once)
        return Twice(once, twice, self.at_frames(twice))

    def integral(self, values: Array) -> Array:
        """Returns the integral (…, n) over time of `values` (…, n), of any unit, on the grid from its beginning."""
        means = 0.5 * self.step_s * (values[..., 1:] + values[..., :-1])
        return np.concatenate([np.zeros((*values.shape[:-1], 1)), np.cumsum(means, axis=-1)], axis=-1)

    def at_frames(self, values: Array) -> Array:
        """Returns the `values` (…, n) on the grid, of any unit, read off at the frames (…, m)."""
        position = np.clip((self.frames_s - self.grid[0]) / self.step_s, 0.0, len(self.grid) - 1.0)
        before = np.minimum(position.astype(np.int64), len(self.grid) - 2)
        return values[..., before] + (position - before) * (values[..., before + 1] - values[..., before])

    def since(self, what: Twice, t0: ArrayLike) -> Array:
        """Returns ∫∫ from each t0 (…,) to each frame, (…, n); zero before t0."""
        start = np.asarray(t0, dtype=np.float64)[..., None]
        passed = self.frames_s - start
        from_start = np.interp(start, self.grid, what.twice) + passed * np.interp(start, self.grid, what.once)
        return np.where(passed > 0, what.at_frames - from_start, 0.0)

    def speed(self, mu: ArrayLike, *, along: float) -> Array:
        """Returns the speed (…, n), m/s, on the grid, of a block that friction mu (…,) holds, lets go and slows down.

        Its impulse since it last lay still: the integral of the pull, less the lowest value that this had so far.
        """
        pulled = along * self.drive.once - np.asarray(mu, dtype=np.float64)[..., None] * self.press.once
        return pulled - np.minimum.accumulate(pulled, axis=-1)

    def tilt(self, t: ArrayLike) -> Array:
        """Returns θ (…,), rad, at each t (…,), s."""
        return np.interp(np.asarray(t, dtype=np.float64), self.grid, self.theta)

    def resting_tilt(self, t: float) -> float:
        """Returns the tilt, rad, at which a plate at rest loads a resting block as this one does at t."""
        theta, (rate, faster) = float(self.tilt(t)), self._turning(t)
        drive = GRAVITY_M_S2 * np.sin(theta) + rate * rate * self.ahead_m
        return float(np.arctan2(drive, GRAVITY_M_S2 * np.cos(theta) - faster * self.ahead_m))

    def _turning(self, t: float) -> tuple[float, float]:
        """Returns θ′ and θ″ at t by the parabola through the readings around it.

        θ″ is smaller where the readings' noise could be it.
        """
        away = np.abs(self.readings_s - t)
        near = away <= max(AROUND_S, float(np.sort(away)[min(LEAST_READINGS, len(away)) - 1]))
        powers = np.vander(self.readings_s[near] - t, 3, increasing=True)
        (_, rate, bend), *_ = np.linalg.lstsq(powers, self.readings_rad[near])
        noise = SURE * self._noise_rad() * float(np.sqrt(np.linalg.pinv(powers.T @ powers)[2, 2]))
        return float(rate), 2.0 * float(bend) * max(1.0 - (noise / max(abs(float(bend)), 1e-12)) ** 2, 0.0)

    def _noise_rad(self) -> float:
        """Returns the noise (rad) of the tilt's readings, by their third differences, which hold √20 of it."""
        return float(np.median(np.abs(np.diff(self.readings_rad, 3)))) / (0.6745 * np.sqrt(20.0))

    def begin(self, mu: float, *, along: float) -> float:
        """Returns the time, s, at which friction mu lets the slide in the last frame begin.

        It is the last moment at rest before that frame.

        A plate that stops its turning can shake the block by less than a step of it, and hold it again.
        """
        resting = np.flatnonzero((self.speed(mu, along=along) <= 0.0) & (self.grid < self.frames_s[-1]))
        return float(self.grid[resting[-1]]) if len(resting) else float(self.grid[0])


def tilt_sigma_rad(readings_s: Array, readings_rad: Array, t: float) -> float:
    """Returns the error (rad) of the curve through the tilt's readings at t (s), from how abruptly that bends there.

    The readings are `readings_rad` (m,) at `readings_s` (m,). A corner midway between two of them changes the bend from
    nothing to half of its own, and is cut by half of that; where the bend changes little the curve is right.
    """
    k = int(np.clip(np.searchsorted(readings_s, t), 3, max(len(readings_s) - 3, 3)))
    jerks = np.diff(readings_rad[k - 3 : k + 3], 3)
    return float(np.abs(jerks).max(initial=0.0)) / 4


def hermite(x: Array, y: Array, slopes: Array, *, at: Array) -> Array:
    """Returns the cubic Hermite curve through y (n,) with these slopes (n,) at rising x (n,), read off at points (m,).

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
