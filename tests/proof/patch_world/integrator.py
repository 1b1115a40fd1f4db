# ruff: noqa: PLR0917, PLR0915 (compiled functions take no keyword-only arguments, and a step is one loop)
"""The equations of motion of the block on its bristles, step by step, in the plate's turning frame.

Each contact point carries a bristle with a mean deflection z (2D, plate frame). Its rate is that of an elasto-plastic
LuGre bristle, with an associated flow rule on the limit ellipse M = diag(m1, m2) of that point:

    z' = v − a(z, v) s0 |M v| M⁻² z,     force on the block  −N (s0 z + s1 z'),

so that steady sliding gives −N M² v / |M v|, which is −N mu v/|v| where m1 = m2 = mu. With a = 0 below a share of the
strength, a bristle is elastic there and does not creep under a load (Dupont et al.). z is advanced implicitly (the
decay is taken at the new z), so it is stable at every speed; velocity and place follow semi-implicitly.

C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky, A new model for control of systems with friction, IEEE TAC 40
(1995). P. Dupont, V. Hayward, B. Armstrong, F. Altpeter, Single state elastoplastic friction models, IEEE TAC 47
(2002). S. Goyal, A. Ruina, J. Papadopoulos, Planar sliding with dry friction, Wear 143 (1991). J. H. Dieterich,
Modeling of rock friction, JGR 84 (1979).

The wall is foam: a spring that gives back a part of what it took, and damping while it is pressed.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tests.proof.patch_world.places import (
    AGE,
    AT_X,
    AT_Y,
    AT_YAW,
    AX,
    AY,
    AZIMUTH,
    BEGIN,
    FRESH,
    HELD,
    LASTS,
    PULL_X,
    PULL_Y,
    SLIP,
    SLOSH_VX,
    SLOSH_VY,
    SLOSH_X,
    SLOSH_Y,
    SPIN,
    TIRED,
    TURNING,
    VX,
    VY,
    WEAKEST,
    YAW,
    T,
    X,
    Y,
)  # fmt: skip
from tests.proof.patch_world.plate import arm, foreign, loads, wall
from tests.proof.patch_world.world import Contact

Array = NDArray[np.float64]

_QUIET_SHARE = 0.5
"""A block at rest whose load is below this share of its strength is not integrated: it only gives elastically."""
_QUIET_SPEED = 2e-6
_SETTLED_S = 1.0
"""The wrist has stopped ringing so long after a motion (e^-30 of it is left)."""
_MOVED_M = 4e-5
"""Friction is looked up anew at each point after the block has moved by so much (the fields vary over millimetres)."""


@njit(cache=True, error_model="numpy")
def _look_up(s: Array, points: Array, sole: Array, waves: Array, spots: Array, strength: Array) -> None:
    """Friction of each point relative to the plain one, from the plate's fields where the point stands now."""
    cosine, sine = math.cos(s[YAW]), math.sin(s[YAW])
    for i in range(points.shape[0]):
        px = s[X] + cosine * points[i, 0] - sine * points[i, 1]
        py = s[Y] + sine * points[i, 0] + cosine * points[i, 1]
        total = 1.0
        for k in range(waves.shape[0]):
            total += waves[k, 3] * math.cos(waves[k, 0] * px + waves[k, 1] * py + waves[k, 2])
        for k in range(spots.shape[0]):
            dx, dy = (px - spots[k, 0]) / spots[k, 2], (py - spots[k, 1]) / spots[k, 2]
            total += spots[k, 3] * math.exp(-0.5 * (dx * dx + dy * dy))
        strength[i] = max(total, 0.05) * sole[i]
    s[AT_X], s[AT_Y], s[AT_YAW], s[FRESH], s[WEAKEST] = s[X], s[Y], s[YAW], 1.0, strength.min()


@njit(cache=True, error_model="numpy")
def _ageing(s: Array, speed: float, flowing: float, ratio: float, dt: float, c: Contact) -> None:
    """Age, slip since the last rest and fatigue of the contacts."""
    slipped = speed * flowing * dt
    s[AGE] = (s[AGE] + dt) / (1 + slipped / c.age_length)
    s[SLIP] += slipped
    if speed < 1e-4:
        s[SLIP] /= 1 + dt / 0.05
    if c.fatigue != 0.0:
        s[TIRED] = 0.0 if ratio < 0.1 else s[TIRED] + dt * (ratio**6 if flowing < 0.999 else 0.0)


@njit(cache=True, error_model="numpy")
def _common(s: Array, c: Contact) -> float:
    """The factor of friction that all points share: slip weakening, age, and fatigue."""
    factor = 1.0
    if c.slip_drop != 0.0:
        factor *= 1 - c.slip_drop * (1 - math.exp(-s[SLIP] / c.slip_length))
    if c.age_gain != 0.0:
        factor *= 1 + c.age_gain * math.log10(1 + s[AGE] / c.age_time)
    if c.fatigue != 0.0:
        factor *= max(1 - c.fatigue * s[TIRED], 0.3)
    return factor


@njit(cache=True, error_model="numpy")
def _at_speed(speed: float, c: Contact) -> float:
    """The factor of friction at a point's sliding speed (m/s)."""
    factor = 1.0
    if c.weak_drop != 0.0:
        factor -= c.weak_drop * (1 - math.exp(-((speed / c.weak_speed) ** c.weak_exponent)))
    if c.direct != 0.0:
        factor += c.direct * math.asinh(speed / (2 * c.direct_speed))
    return max(factor, 0.05)


@njit(cache=True, error_model="numpy")
def pressures(
    pull_x: float, pull_y: float, yaw: float, points: Array, share: Array, balance: Array, out: Array
) -> None:
    """Each point's share of the normal load, such that the resultant balances the overturning moment.

    Args:
        pull_x: where the resultant must lie from the block's centre, plate frame (m), and its y.
        pull_y: the y of it.
        yaw: of the block (rad).
        points: (n, 2), block frame.
        share: (n) of each point under an even load.
        balance: (3, 3), from `balance_of`.
        out: (n), filled; its sum is one.
    """
    cosine, sine = math.cos(yaw), math.sin(yaw)
    bx, by = cosine * pull_x + sine * pull_y, -sine * pull_x + cosine * pull_y
    a = balance[0, 0] + balance[0, 1] * bx + balance[0, 2] * by
    kx = balance[1, 0] + balance[1, 1] * bx + balance[1, 2] * by
    ky = balance[2, 0] + balance[2, 1] * bx + balance[2, 2] * by
    total = 0.0
    for i in range(points.shape[0]):
        out[i] = max(share[i] * (a + kx * points[i, 0] + ky * points[i, 1]), 0.0)
        total += out[i]
    for i in range(points.shape[0]):
        out[i] /= total


@njit(cache=True, error_model="numpy")
def _friction(
    s: Array, z: Array, dt: float, factor: float, points: Array, load: Array, strength: Array, c: Contact
) -> tuple[float, float, float, float, float]:
    """Advances all bristles; returns force and moment per newton of load, mean flow and mean share of strength."""
    cosine, sine = math.cos(s[YAW]), math.sin(s[YAW])
    sums_x = sums_y = moment = flow = used = 0.0
    ratio, axis = c.plate_ratio, c.plate_axis
    if c.sole_ratio != 0.0:
        ratio, axis = c.sole_ratio, c.sole_axis + s[YAW]
    ex, ey = math.cos(axis), math.sin(axis)
    plate_x, plate_y = math.cos(c.plate_nap_axis), math.sin(c.plate_nap_axis)
    sole_x, sole_y = math.cos(c.sole_nap_axis + s[YAW]), math.sin(c.sole_nap_axis + s[YAW])
    for i in range(points.shape[0]):
        rx = cosine * points[i, 0] - sine * points[i, 1]
        ry = sine * points[i, 0] + cosine * points[i, 1]
        vx, vy = s[VX] - s[SPIN] * ry, s[VY] + s[SPIN] * rx
        speed = math.sqrt(vx * vx + vy * vy)
        mu = factor * strength[i] * _at_speed(speed, c)
        zx, zy = z[i, 0], z[i, 1]
        nx, ny = zx + vx * dt, zy + vy * dt
        if c.plate_nap != 0.0 or c.sole_nap != 0.0:
            bent = math.sqrt(nx * nx + ny * ny) + 1e-12
            mu *= (
                1 + c.plate_nap * (nx * plate_x + ny * plate_y) / bent + c.sole_nap * (nx * sole_x + ny * sole_y) / bent
            )
        m1, m2 = mu * (1 + ratio), mu * (1 - ratio)
        v1, v2 = ex * vx + ey * vy, -ey * vx + ex * vy
        n1, n2 = ex * nx + ey * ny, -ey * nx + ex * ny
        full = c.stiffness * math.sqrt((n1 / m1) ** 2 + (n2 / m2) ** 2)
        flowing = 0.0
        if nx * vx + ny * vy > 0.0 and full > c.elastic_share:
            flowing = 1.0
            if full < 1.0:
                middle, width = 0.5 * (1 + c.elastic_share), 1 - c.elastic_share
                flowing = 0.5 + 0.5 * math.sin(math.pi * (full - middle) / width)
        decay = flowing * c.stiffness * math.sqrt((m1 * v1) ** 2 + (m2 * v2) ** 2) * dt
        n1, n2 = n1 / (1 + decay / (m1 * m1)), n2 / (1 + decay / (m2 * m2))
        nx, ny = ex * n1 - ey * n2, ey * n1 + ex * n2
        fx = -load[i] * (c.stiffness * nx + c.damping * (nx - zx) / dt)
        fy = -load[i] * (c.stiffness * ny + c.damping * (ny - zy) / dt)
        z[i, 0], z[i, 1] = nx, ny
        sums_x, sums_y = sums_x + fx, sums_y + fy
        moment += rx * fy - ry * fx
        flow += load[i] * flowing
        used += load[i] * min(full, 1.0)
    return sums_x, sums_y, moment, flow, used


@njit(cache=True, error_model="numpy")
def _rest(s: Array, z: Array, px: float, py: float, press: float, c: Contact) -> None:
    """A block that rests gives elastically: every bristle carries its share of the load."""
    gx, gy = px / (press * c.stiffness), py / (press * c.stiffness)
    s[X] += gx - z[0, 0]
    s[Y] += gy - z[0, 1]
    for i in range(z.shape[0]):
        z[i, 0], z[i, 1] = gx, gy
    s[VX] = s[VY] = s[SPIN] = 0.0
    s[AX] = s[AY] = s[TURNING] = 0.0
    s[SLOSH_X], s[SLOSH_Y] = px / c.slosh_omega**2, py / c.slosh_omega**2
    s[SLOSH_VX] = s[SLOSH_VY] = 0.0


@njit(cache=True, error_model="numpy")
def advance(
    until: float,
    dt: float,
    s: Array,
    z: Array,
    strength: Array,
    load: Array,
    points: Array,
    share: Array,
    balance: Array,
    sole: Array,
    waves: Array,
    spots: Array,
    tones: Array,
    motion: Array,
    run_mu: float,
    numbers: Array,
) -> None:
    """Advances the state to a time in steps of dt (s). All arrays of state are changed in place.

    Args:
        until: the time to reach (s).
        dt: the step (s).
        s: the state (SIZE).
        z: the bristles' deflections (n, 2), plate frame, m.
        strength: each point's friction, relative (n); filled when the block has moved.
        load: each point's share of the load (n); filled.
        points: the points of the sole (n, 2), block frame, m.
        share: their shares of an even load (n).
        balance: (3, 3), of `balance_of`.
        sole: their friction, relative (n).
        waves: (k, 4): wave vector (rad/m), phase and amplitude of the plate's and the run's fields.
        spots: (m, 4): x, y, radius (m), change.
        tones: (j, 4): Hz, m/s² along x and y, phase.
        motion: the arm's motion in progress.
        run_mu: friction of this run, relative.
        numbers: the world's, as `numbers_of` gives them.
    """
    c = numbers[0]
    if s[HELD] == 1.0 and s[T] > motion[BEGIN] + motion[LASTS] + _SETTLED_S and tones.shape[0] == 0 and c.gust_n == 0.0:
        s[AGE] += until - s[T]  # nothing moves: the contacts age
        s[SLIP], s[TIRED] = 0.0, 0.0
        s[T] = until
        return
    steps = round((until - s[T]) / dt)
    inertia = c.mass * (c.half_x * c.half_x + c.half_y * c.half_y) / 3.0
    for _ in range(steps):
        turning = arm(s, motion, dt, c)
        px, py, press = loads(s, motion[AZIMUTH], turning, tones, c)
        press = max(press, 0.0)
        fx, fy = foreign(s, c)
        wx, wy, wall_moment = wall(s, c)
        px, py = px + (fx + wx) / c.mass, py + (fy + wy) / c.mass
        s[T] += dt
        moved = abs(s[X] - s[AT_X]) + abs(s[Y] - s[AT_Y]) + 0.01 * abs(s[YAW] - s[AT_YAW])
        if s[FRESH] == 0.0 or moved > _MOVED_M:
            _look_up(s, points, sole, waves, spots, strength)
        factor = c.mu * run_mu * _common(s, c)
        if s[HELD] == 1.0:
            weakest = factor * (1 - abs(c.plate_ratio) - abs(c.sole_ratio) - abs(c.plate_nap) - abs(c.sole_nap))
            weakest *= s[WEAKEST] * press
            if px * px + py * py < (_QUIET_SHARE * weakest) ** 2:
                used = math.sqrt(px * px + py * py) / (weakest + 1e-12)
                _rest(s, z, px, py, press, c)
                _ageing(s, 0.0, 0.0, used, dt, c)
                continue
            s[HELD] = 0.0
        pressures(s[PULL_X], s[PULL_Y], s[YAW], points, share, balance, load)
        gx, gy, moment, flow, used = _friction(s, z, dt, factor, points, load, strength, c)
        # The resultant of the load lies where it balances the friction's moment about the centre of mass.
        blend = min(dt / 1e-3, 1.0)
        s[PULL_X] += blend * (-0.5 * c.height * gx - s[PULL_X])
        s[PULL_Y] += blend * (-0.5 * c.height * gy - s[PULL_Y])
        ax, ay = px + press * gx - c.film * s[VX] / c.mass, py + press * gy - c.film * s[VY] / c.mass
        if c.slosh_share != 0.0:
            # The inner mass is driven by what the box does; the box feels its spring and damper.
            k, d = c.slosh_omega * c.slosh_omega, 2 * c.slosh_damping * c.slosh_omega
            pull_x = k * s[SLOSH_X] + d * s[SLOSH_VX]
            pull_y = k * s[SLOSH_Y] + d * s[SLOSH_VY]
            rest = 1 - c.slosh_share
            box_x = (press * gx + (wx + fx) / c.mass + c.slosh_share * pull_x) / rest + (px - (fx + wx) / c.mass)
            box_y = (press * gy + (wy + fy) / c.mass + c.slosh_share * pull_y) / rest + (py - (fy + wy) / c.mass)
            s[SLOSH_VX] += dt * (px - (fx + wx) / c.mass - pull_x - box_x)
            s[SLOSH_VY] += dt * (py - (fy + wy) / c.mass - pull_y - box_y)
            s[SLOSH_X] += dt * s[SLOSH_VX]
            s[SLOSH_Y] += dt * s[SLOSH_VY]
            ax, ay = box_x, box_y
        s[VX] += dt * ax
        s[VY] += dt * ay
        turn = (press * c.mass * moment + wall_moment) / inertia
        s[SPIN] += dt * turn
        s[AX] += blend * (ax - s[AX])
        s[AY] += blend * (ay - s[AY])
        s[TURNING] += blend * (turn - s[TURNING])
        s[X] += dt * s[VX]
        s[Y] += dt * s[VY]
        s[YAW] += dt * s[SPIN]
        speed = math.hypot(s[VX], s[VY])
        _ageing(s, speed, flow, used, dt, c)
        quiet = speed < _QUIET_SPEED and abs(s[SPIN]) < 1e-4 and used < 0.8 * _QUIET_SHARE
        if quiet and abs(s[SLOSH_VX]) + abs(s[SLOSH_VY]) < 1e-4:
            s[HELD] = 1.0
    s[T] = until


def numbers_of(contact: Contact) -> Array:
    """The numbers of a world as one record, whose fields have their names."""
    return np.array([tuple(contact)], dtype=[(name, np.float64) for name in Contact._fields])


def balance_of(points: Array, share: Array) -> Array:
    """The inverse (3, 3) of the moments of the points (n, 2) with shares (n): see `pressures`."""
    columns = np.column_stack([np.ones(len(points)), points])
    moments = columns.T @ (share[:, None] * columns)
    return np.ascontiguousarray(np.linalg.inv(moments), dtype=np.float64)
