"""The exact planar slider: onset and path of a block on a tilting plate, by event-driven integration.

This is the reference that the simulators are measured against, written for exactness and not for speed. The block is a
point at the height of the pivot; the plate turns about an axis through the pivot, in the plate's plane. In the plate
frame, with tilt θ about the axis t (a unit vector in the plate), n the normal and r, v the block's place and velocity,

    a = g sin θ s + ω² (r · s) s − μ-force/m,      s = t × n: down the slope,
    N/m = g cos θ + 2 ω (t × v)·n,

where ω is the tilt's rate (rigid-body kinematics in a turning frame; between knots it does not change). The limit
curve is an ellipse; the sliding force follows the principle of maximum dissipation:
−N (μ₁² v₁, μ₂² v₂) / sqrt(μ₁² v₁² + μ₂² v₂²).
For a circle and a slow ramp the path after the onset is x = g ω t³ / (6 cos θ) (`ramp_displacement`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

FLOATS = NDArray[np.float64]
GRAVITY = 9.81
START_SPEED = 1e-8
CREEP_SPEED = 1e-5
"""Speed (m/s) below which the direction is held back from turning ever faster, for some nanometres of the way."""


@dataclass(frozen=True, kw_only=True)
class Tilt:
    """A tilt profile: straight lines between (time, angle) knots, about the axis at `azimuth_rad` from x in the plate.

    A positive angle turns the plate right-handed about the axis, so it slopes down along t × z of the level plate:
    azimuth 0 (the x axis) slopes down towards −y.
    """

    time_s: tuple[float, ...]
    angle_rad: tuple[float, ...]
    azimuth_rad: float = 0.0

    def __post_init__(self) -> None:
        """Refuses, by a ValueError, knots that do not ascend in time."""
        if len(self.time_s) != len(self.angle_rad) or len(self.time_s) < 2:
            raise ValueError("expected as many angles as times, and at least two")
        if not all(b > a for a, b in zip(self.time_s, self.time_s[1:], strict=False)):
            raise ValueError("the times must ascend")

    @property
    def axis(self) -> FLOATS:
        """The tilt axis in the plate, (2,)."""
        return np.array([math.cos(self.azimuth_rad), math.sin(self.azimuth_rad)])

    @property
    def slope(self) -> FLOATS:
        """Down the slope for a positive angle, (2,)."""
        return np.array([math.sin(self.azimuth_rad), -math.cos(self.azimuth_rad)])


@dataclass(frozen=True, kw_only=True)
class LimitCurve:
    """Elliptic limit curve in the plate frame: mu along the axis at `axis_rad` from x, and mu across it."""

    mu_along: float
    mu_across: float
    axis_rad: float = 0.0

    @property
    def turn(self) -> FLOATS:
        """Rows: the unit vectors along and across the axis, (2, 2)."""
        c, s = math.cos(self.axis_rad), math.sin(self.axis_rad)
        return np.array([[c, s], [-s, c]])

    @property
    def mu(self) -> FLOATS:
        """mu along and across, (2,)."""
        return np.array([self.mu_along, self.mu_across])


@dataclass(frozen=True)
class Slide:
    """The block's motion: `onset_s` (nan: it never slid), and its path in the plate, (n,), (n, 2), (n, 2)."""

    onset_s: float
    onset_rad: float
    time_s: FLOATS
    place_m: FLOATS
    velocity_m_s: FLOATS


def ramp_displacement(seconds: float, *, rate_rad_s: float, onset_rad: float, gravity: float = GRAVITY) -> float:
    """Gives the distance slid since the onset on a plate that goes on tilting at a constant rate (to leading order)."""
    return gravity * rate_rad_s * seconds**3 / (6 * math.cos(onset_rad))


def onset_angle(curve: LimitCurve, slope: FLOATS) -> float:
    """Returns the tilt at which a resting block starts, tilted slowly so that `slope`, (2,), points down."""
    return math.atan(1 / float(np.linalg.norm(curve.turn @ slope / curve.mu)))


def simulate(
    tilt: Tilt,
    curve: LimitCurve,
    *,
    start_m: Sequence[float] = (0.0, 0.0),
    output_s: float = 0.01,
    gravity: float = GRAVITY,
) -> Slide:
    """Follows a block that rests at `start_m` through the whole profile; the path is sampled every `output_s`."""
    path = _Path(output_s)
    state = np.array([*start_m, 0.0, 0.0])
    onset = (math.nan, math.nan)
    for begin, end in itertools.pairwise(zip(tilt.time_s, tilt.angle_rad, strict=True)):
        stretch = _Stretch(begin, end, tilt.slope, curve, gravity)
        now = stretch.begin_s
        while now < stretch.end_s - 1e-12:
            if not state[2:].any():
                start = stretch.slip_time(now, state)
                path.rest(now, start, state)
                if (now := start) >= stretch.end_s:
                    break
                onset = (now, stretch.angle(now)) if math.isnan(onset[0]) else onset
                state = stretch.nudged(now, state)
            found = stretch.slip(now, state)
            path.slide(now, found, curve)
            now, state = float(found.t[-1]), _cartesian(curve, found.y[:, -1])
            if found.status == 1:
                state[2:] = 0.0
    states = np.array(path.states)
    return Slide(*onset, np.array(path.times), states[:, :2], states[:, 2:])


class _Path:
    """The states at the multiples of a step."""

    def __init__(self, step_s: float) -> None:
        self._step_s = step_s
        self.times: list[float] = []
        self.states: list[FLOATS] = []

    def rest(self, begin_s: float, end_s: float, state: FLOATS) -> None:
        self._add(begin_s, end_s, lambda _: state)

    def slide(self, begin_s: float, found: Any, curve: LimitCurve) -> None:
        self._add(begin_s, float(found.t[-1]), lambda time: _cartesian(curve, found.sol(time)))

    def _add(self, begin_s: float, end_s: float, at: Callable[[float], FLOATS]) -> None:
        first, last = (math.ceil(time / self._step_s - 1e-9) for time in (begin_s, end_s))
        for number in range(first, last):
            self.times.append(number * self._step_s)
            self.states.append(at(number * self._step_s))


class _Stretch:
    """A straight stretch of the profile, from knot to knot, each (s, rad)."""

    def __init__(
        self, begin: tuple[float, float], end: tuple[float, float], slope: FLOATS, curve: LimitCurve, gravity: float
    ) -> None:  # fmt: skip
        (self.begin_s, self._angle), self.end_s = begin, end[0]
        self._rate = (end[1] - begin[1]) / (end[0] - begin[0])
        self._slope, self._curve, self._gravity = slope, curve, gravity

    def angle(self, now: float) -> float:
        return self._angle + self._rate * (now - self.begin_s)

    def drive(self, now: float, state: FLOATS) -> tuple[FLOATS, float]:
        """Returns the pull along the plate (2,) and the press across it, both per mass (m/s²)."""
        angle, rate, slope = self.angle(now), self._rate, self._slope
        along = (self._gravity * math.sin(angle) + rate**2 * float(state[:2] @ slope)) * slope
        return along, self._gravity * math.cos(angle) - 2 * rate * float(state[2:] @ slope)

    def slip_time(self, now: float, state: FLOATS) -> float:
        """Returns the time at which a resting block starts; the end of the stretch if it does not."""

        def excess(time: float) -> float:
            along, normal = self.drive(time, state)
            return float(np.linalg.norm(self._curve.turn @ along / self._curve.mu)) - normal

        if excess(now) > 0:
            return now
        grid = np.linspace(now, self.end_s, 65).tolist()
        for left, right in itertools.pairwise(grid):
            if excess(right) > 0:
                root: Any = brentq(excess, left, right, xtol=1e-14)
                return float(root)
        return self.end_s

    def nudged(self, now: float, state: FLOATS) -> FLOATS:
        """Gives the state just after the onset: the first motion is normal to the limit curve at the force reached."""
        curve = self._curve
        along, _ = self.drive(now, state)
        way = curve.turn.T @ (curve.turn @ along / curve.mu**2)
        return np.concatenate([state[:2], START_SPEED * way / np.linalg.norm(way)])

    def slip(self, now: float, state: FLOATS) -> Any:
        """Integrates the slide until the block stops, or until the stretch ends.

        The velocity is integrated as speed and direction: the speed then passes smoothly through zero, where the
        event finds the stop, and the direction's fast relaxation at low speed is left to an implicit method.
        """
        curve = self._curve
        along2, across2 = (curve.mu**2).tolist()

        def rates(time: float, y: FLOATS) -> FLOATS:
            speed, c, s = y[2], math.cos(y[3]), math.sin(y[3])
            velocity = curve.turn.T @ (speed * np.array([c, s]))
            pull, normal = self.drive(time, np.array([y[0], y[1], *velocity]))
            ahead, aside = np.array([[c, s], [-s, c]]) @ (curve.turn @ pull)
            size = math.sqrt(along2 * c * c + across2 * s * s)
            turning = aside - normal * (across2 - along2) * s * c / size
            return np.array([*velocity, ahead - normal * size, turning / math.hypot(speed, CREEP_SPEED)])

        def stopped(time: float, y: FLOATS) -> float:
            del time
            return y[2]

        stopped.terminal, stopped.direction = True, -1  # pyright: ignore[reportFunctionMemberAccess] (SciPy reads them)
        local = curve.turn @ state[2:]
        first = np.array([state[0], state[1], math.hypot(*local), math.atan2(local[1], local[0])])
        return solve_ivp(
            rates, (now, self.end_s), first, method="LSODA", rtol=1e-9, atol=1e-12, events=stopped, dense_output=True
        )


def _cartesian(curve: LimitCurve, y: FLOATS) -> FLOATS:
    """Returns place and velocity from place, speed and direction."""
    return np.concatenate([y[:2], curve.turn.T @ (y[2] * np.array([math.cos(y[3]), math.sin(y[3])]))])
