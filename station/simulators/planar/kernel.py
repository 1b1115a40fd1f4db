"""The planar slider's inner loop, compiled: stick and slip as events, an elliptic limit curve, a piecewise linear tilt.

The equations are those of `station.simulators.slider`, which is exact and slow; a test holds this one to it. The
onset is bisected to a nanosecond. A slide is integrated as speed v and direction φ by Runge-Kutta steps of at most
2.5 ms; a stop is where v passes through zero. Below `SLOW` the direction is kept: it would relax to that of the
flow rule within v / (mu g), which is faster than a step, and there it already is.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

FLOATS = NDArray[np.float64]
SLOW = 6e-3
STEP_S = 2.5e-3
BISECTIONS = 40


Law = tuple[float, float, float, float, float]
"""The slope's components along and across the limit curve's axis, mu squared along and across it, gravity."""
Piece = tuple[float, float, float, float]
"""A straight stretch of the tilt: begin and end (s), first angle (rad), rate (rad/s)."""


@njit(cache=True, fastmath={"contract", "arcp", "reassoc"}, error_model="numpy")
def tilt(knots: FLOATS, law: Law, start_m: FLOATS, output_s: float, path: FLOATS) -> tuple[float, float]:
    """Runs one tilt; fills `path`, (n, 4): x, y, vx, vy at the multiples of `output_s`, all in the curve's axes.

    `knots`, (k, 2), are times and angles. Returns time and angle of the onset, nan when the block never slid.
    """
    state = np.array([start_m[0], start_m[1], 0.0, 0.0])
    onset, onset_angle, row, moving = math.nan, math.nan, 0, False
    for k in range(len(knots) - 1):
        begin, end = knots[k, 0], knots[k + 1, 0]
        piece = (begin, end, knots[k, 1], (knots[k + 1, 1] - knots[k, 1]) / (end - begin))
        now = begin
        while now < end:
            if not moving:
                now = _slip_time(law, piece, now, state)
                row = _record(path, row, output_s, now - 1e-12, state)
                if now >= end:
                    break
                moving, state[3] = True, _first_way(law, _angle(piece, now))
                if math.isnan(onset):
                    onset, onset_angle = now, _angle(piece, now)
            step = min(STEP_S, end - now)
            if row < len(path) and row * output_s > now:
                step = min(step, row * output_s - now)
            took = _advance(law, piece, now, step, state)
            now, moving = now + took, state[2] > 0
            if not moving:
                now = max(now, now + 1e-9 - took)  # a slip that ends where it began must not hold up the time
            row = _record(path, row, output_s, now + 1e-12, state)
    _record(path, row, output_s, math.inf, state)
    return onset, onset_angle


@njit(cache=True, inline="always")
def _angle(piece: Piece, time: float) -> float:
    return piece[2] + piece[3] * (time - piece[0])


@njit(cache=True, inline="always")
def _drive(law: Law, piece: Piece, time: float, state: Any) -> float:
    """What pulls the block along the slope (m/s²): gravity, and the turning plate's outward share."""
    outward = piece[3] * piece[3] * (state[0] * law[0] + state[1] * law[1])
    return law[4] * math.sin(_angle(piece, time)) + outward


@njit(cache=True, fastmath={"contract", "arcp", "reassoc"}, error_model="numpy")
def _excess(law: Law, piece: Piece, time: float, state: Any) -> float:
    """What a resting block needs beyond its normal force, in units of its friction (m/s²)."""
    ease = math.sqrt(law[0] * law[0] / law[2] + law[1] * law[1] / law[3])
    return abs(_drive(law, piece, time, state)) * ease - law[4] * math.cos(_angle(piece, time))


@njit(cache=True, fastmath={"contract", "arcp", "reassoc"}, error_model="numpy")
def _slip_time(law: Law, piece: Piece, now: float, state: Any) -> float:
    """When a resting block starts; the end of the stretch when it does not."""
    if _excess(law, piece, now, state) > 0:
        return now
    if _excess(law, piece, piece[1], state) <= 0:
        return piece[1]
    low, high = now, piece[1]
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if _excess(law, piece, middle, state) > 0:
            high = middle
        else:
            low = middle
    return high


@njit(cache=True, inline="always")
def _first_way(law: Law, angle: float) -> float:
    """The direction of the first motion: normal to the limit curve at the force that it reached."""
    way = math.atan2(law[1] / law[3], law[0] / law[2])
    return way if angle >= 0 else way + math.pi


@njit(cache=True, fastmath={"contract", "arcp", "reassoc"}, error_model="numpy")
def _rates(law: Law, piece: Piece, time: float, state: Any) -> tuple[float, float]:
    """Change of the speed and of the direction of `state`: x, y, speed, direction."""
    c, s, speed, drive = math.cos(state[3]), math.sin(state[3]), state[2], _drive(law, piece, time, state)
    down = c * law[0] + s * law[1]
    normal = max(law[4] * math.cos(_angle(piece, time)) - 2 * piece[3] * speed * down, 0.0)
    size = math.sqrt(law[2] * c * c + law[3] * s * s)
    turning = drive * (c * law[1] - s * law[0]) - normal * (law[3] - law[2]) * s * c / size
    return drive * down - normal * size, turning / speed if speed > SLOW else 0.0


@njit(cache=True, fastmath={"contract", "arcp", "reassoc"}, error_model="numpy")
def _advance(law: Law, piece: Piece, now: float, step: float, state: Any) -> float:
    """One Runge-Kutta step of the slide in place, cut short where the block stops; returns the time that it took."""
    x, y, v, phi = state[0], state[1], state[2], state[3]
    half, late = now + 0.5 * step, now + step
    a1, b1 = _rates(law, piece, now, (x, y, v, phi))
    a2, b2 = _rates(law, piece, half, (x, y, v + 0.5 * step * a1, phi + 0.5 * step * b1))
    a3, b3 = _rates(law, piece, half, (x, y, v + 0.5 * step * a2, phi + 0.5 * step * b2))
    a4, b4 = _rates(law, piece, late, (x, y, v + step * a3, phi + step * b3))
    after, turned = v + step * (a1 + 2 * a2 + 2 * a3 + a4) / 6, phi + step * (b1 + 2 * b2 + 2 * b3 + b4) / 6
    middle = 0.5 * (v + after) + step * (a1 - a4) / 8  # of the cubic through both ends, for Simpson's rule
    if after <= 0:
        step *= v / (v - after) if v > after else 0.0
        middle, after = 0.5 * v, 0.0
    gone, way = step * (v + 4 * middle + after) / 6, 0.5 * (phi + turned)
    state[0], state[1] = x + gone * math.cos(way), y + gone * math.sin(way)
    state[2], state[3] = after, turned
    return step


@njit(cache=True, inline="always")
def _record(path: Any, row: int, output_s: float, until: float, state: Any) -> int:
    """Writes the state into the rows up to a time; returns the next row."""
    while row < len(path) and row * output_s <= until:
        path[row, 0], path[row, 1] = state[0], state[1]
        path[row, 2], path[row, 3] = state[2] * math.cos(state[3]), state[2] * math.sin(state[3])
        row += 1
    return row
