"""The arm and the plate: the wrist rings, the turning plate loads the block, and some forces are no friction."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tests.proof.patch_world.places import (
    ANGLE,
    BEGIN,
    LASTS,
    MEASURED,
    MEASURED_RATE,
    PLAY,
    POLYNOMIAL,
    RATE,
    SEEN,
    SEEN_RATE,
    SPIN,
    VX,
    VY,
    YAW,
    T,
    X,
    Y,
)  # fmt: skip
from tests.proof.patch_world.world import Contact

Array = NDArray[np.float64]
_FOAM_TURNS_M_S = 5e-3
"""The speed within which foam goes from loading to giving back; a jump would shake a block that rests against it."""


@njit(cache=True, error_model="numpy")
def angle_asked(t: float, motion: Array) -> float:
    """The angle (rad) that the arm's controller asks for at a time (s)."""
    s = min(max(t - motion[BEGIN], 0.0), motion[LASTS])
    total = 0.0
    for k in range(5, -1, -1):
        total = total * s + motion[POLYNOMIAL + k]
    return total


@njit(cache=True, error_model="numpy")
def arm(s: Array, motion: Array, dt: float, c: Contact) -> float:
    """Advances the arm by a step; returns the plate's angular acceleration (rad/s²).

    The wrist rings as a damped oscillator about the angle behind the gears' play; the encoders see the one before it.
    """
    asked = angle_asked(s[T] + dt, motion)
    s[PLAY] = min(max(s[PLAY], asked - c.play), asked + c.play)
    omega = 2 * math.pi * c.ring_hz
    before = s[RATE]
    s[RATE] += dt * (omega * omega * (s[PLAY] - s[ANGLE]) - 2 * c.ring_damping * omega * s[RATE])
    s[ANGLE] += dt * s[RATE]
    s[SEEN_RATE] += dt * (omega * omega * (asked - s[SEEN]) - 2 * c.ring_damping * omega * s[SEEN_RATE])
    s[SEEN] += dt * s[SEEN_RATE]
    s[MEASURED] += (s[SEEN] - s[MEASURED]) * (dt / c.angle_filter if c.angle_filter > dt else 1.0)
    s[MEASURED_RATE] += (s[SEEN_RATE] - s[MEASURED_RATE]) * (dt / c.rate_filter if c.rate_filter > dt else 1.0)
    return (s[RATE] - before) / dt


@njit(cache=True, error_model="numpy")
def loads(s: Array, azimuth: float, turning: float, tones: Array, c: Contact) -> tuple[float, float, float]:
    """The block's load in the plate's frame (m/s²): x, y, and what presses it on; all of it but contact forces."""
    cosine, sine = math.cos(s[ANGLE]), math.sin(s[ANGLE])
    ax, ay = math.cos(azimuth), math.sin(azimuth)
    # Gravity in the world leans where the plate is level in name only; it is turned back about the tilting axis.
    gx, gy = c.gravity * c.lean_x, c.gravity * c.lean_y
    gz = -math.sqrt(c.gravity * c.gravity - gx * gx - gy * gy)
    along = ax * gx + ay * gy
    px = cosine * gx - sine * (ay * gz) + (1 - cosine) * along * ax
    py = cosine * gy - sine * (-ax * gz) + (1 - cosine) * along * ay
    pz = cosine * gz - sine * (ax * gy - ay * gx)
    # From the true pivot to the centre of mass; w = rate (ax, ay, 0).
    rx, ry = s[X] - c.pivot_x, s[Y] - c.pivot_y
    rz = 0.5 * c.height - c.pivot_height - c.pivot_z
    w = s[RATE]
    across = ax * ry - ay * rx  # (axis × r)_z
    cross_x, cross_y = ay * rz, -ax * rz
    px -= turning * cross_x + w * w * (ay * across)
    py -= turning * cross_y + w * w * (-ax * across)
    pz -= turning * across + w * w * (ax * cross_y - ay * cross_x)
    pz -= 2 * w * (ax * s[VY] - ay * s[VX])  # Coriolis: the sliding block presses more or less
    for k in range(tones.shape[0]):
        swing = math.cos(2 * math.pi * tones[k, 0] * s[T] + tones[k, 3])
        px += tones[k, 1] * swing
        py += tones[k, 2] * swing
    return px, py, -pz


@njit(cache=True, error_model="numpy")
def foreign(s: Array, c: Contact) -> tuple[float, float]:
    """The forces (N) of magnet, thread and gusts on the block."""
    fx = fy = 0.0
    if c.magnet_n != 0.0:
        dx, dy = (c.magnet_x - s[X]) / c.magnet_reach, (c.magnet_y - s[Y]) / c.magnet_reach
        pull = c.magnet_n * math.exp(0.5 - 0.5 * (dx * dx + dy * dy))  # its greatest is magnet_n, one reach away
        fx, fy = fx + pull * dx, fy + pull * dy
    if c.thread_n_m != 0.0:
        fx += c.thread_n_m * (c.thread_x - s[X])
        fy += c.thread_n_m * (c.thread_y - s[Y])
    if c.gust_n != 0.0 and (s[T] / c.gust_period) % 1.0 < c.gust_share:
        fx += c.gust_n * math.cos(c.gust_axis)
        fy += c.gust_n * math.sin(c.gust_axis)
    return fx, fy


@njit(cache=True, error_model="numpy")
def wall(s: Array, c: Contact) -> tuple[float, float, float]:
    """Force (N) and moment (N m) of the foam on the block's corners: a spring that gives back a part, and damping."""
    fx = fy = moment = 0.0
    if math.hypot(s[X], s[Y]) + math.hypot(c.half_x, c.half_y) < c.wall_radius:
        return fx, fy, moment
    cosine, sine = math.cos(s[YAW]), math.sin(s[YAW])
    for k in range(4):
        bx, by = c.half_x * (1 - 2 * (k & 1)), c.half_y * (1 - (k & 2))
        rx, ry = cosine * bx - sine * by, sine * bx + cosine * by
        px, py = s[X] + rx, s[Y] + ry
        far = math.hypot(px, py)
        if far > c.wall_radius:
            ux, uy = px / far, py / far
            outward = (s[VX] - s[SPIN] * ry) * ux + (s[VY] + s[SPIN] * rx) * uy
            given = 0.5 * (1 + math.tanh(outward / _FOAM_TURNS_M_S))
            push = c.wall_stiffness * (far - c.wall_radius) * (c.wall_return + (1 - c.wall_return) * given)
            push += c.wall_damping * max(outward, 0.0)
            fx, fy = fx - push * ux, fy - push * uy
            moment += -rx * push * uy + ry * push * ux
    return fx, fy, moment
