# ruff: noqa: PLR0917 (compiled functions take no keyword-only arguments)
"""The hidden physics, compiled: forces that drive the block and that hold it, per unit of mass.

Friction is a set of forces: `capacity` is its radius in the direction of the force, and sliding dissipates as much as
it can (Goyal, Ruina, Papadopoulos 1991): the friction force is the point of the set nearest to what would stop the
block within the step (Moreau 1988), so that sticking and sliding are one law and friction never adds energy.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tests.concealed.compiled import compiled
from tests.concealed.world import GRAVITY, TURNING_ARM, RunFacts, World


@compiled
def gravity_of(world: World, azimuth: float, tilt: float) -> tuple[float, float, float]:
    """Gravity in the plate frame (x, y, z), as a unit vector, of a plate whose level is off by the world's."""
    gx, gy = world.level_x, world.level_y
    gz = -math.sqrt(max(0.0, 1.0 - gx * gx - gy * gy))
    c, s = math.cos(azimuth), math.sin(azimuth)
    along = c * gx + s * gy
    cos_t, sin_t = math.cos(tilt), math.sin(tilt)
    # Rodrigues' rotation by −tilt about (c, s, 0).
    x = gx * cos_t - s * gz * sin_t + c * along * (1.0 - cos_t)
    y = gy * cos_t + c * gz * sin_t + s * along * (1.0 - cos_t)
    z = gz * cos_t - (c * gy - s * gx) * sin_t
    return x, y, z


@compiled
def true_tilt(world: World, reported: float) -> float:
    """The tilt that the plate has when the arm reports `reported`; the offset fades out towards level."""
    return (reported - world.offset * math.tanh(reported / 0.02)) / (1.0 + world.scale)


@compiled
def shaking(world: World, run: RunFacts, time_s: float) -> float:
    """Acceleration noise along the steepest line (m/s²): three near tones, stronger in some poses of the arm."""
    gain = world.shake * (0.5 + 0.5 * math.cos(run.azimuth - world.shake_axis)) ** 2
    turn = 2.0 * math.pi * world.shake_hz * time_s
    p = run.shake_phase
    total = math.sin(turn + p) + 0.7 * math.sin(1.37 * turn + 2.3 * p) + 0.5 * math.sin(0.61 * turn + 5.1 * p)
    return gain * total / 1.32


@compiled
def drive(
    world: World, run: RunFacts, x: float, y: float, tilt: float, turning: Any, shaken: float, v: Any
) -> tuple[float, float, float]:
    """Returns the pull on the block along the plate (x, y) and the pressing on it (m/s²).

    `turning` are the tilt's rate and acceleration, `v` the block's velocity in the plate: in the frame of a turning
    plate there are a centrifugal pull, and Coriolis and Euler forces that press.
    """
    gx, gy, gz = gravity_of(world, run.azimuth, tilt)
    down_x, down_y = math.sin(run.azimuth), -math.cos(run.azimuth)
    # A block above the pivot is carried downhill by a growing tilt, and lags behind.
    far, fast = down_x * x + down_y * y, down_x * v[0] + down_y * v[1]
    extra = -world.pivot_height * turning[1] + shaken + turning[0] ** 2 * far
    ax, ay = GRAVITY * gx + extra * down_x, GRAVITY * gy + extra * down_y
    if world.bend_per_m != 0.0:
        bent = GRAVITY * world.bend_per_m * math.sin(tilt)
        ax, ay = ax + bent * x, ay + bent * y
    if world.magnet != 0.0:
        to_x, to_y = world.magnet_x - x, world.magnet_y - y
        fall = (1.0 + (to_x * to_x + to_y * to_y) / world.magnet_radius**2) ** 2
        ax += world.magnet * to_x / world.magnet_radius / fall
        ay += world.magnet * to_y / world.magnet_radius / fall
    return ax, ay, max(-GRAVITY * gz - 2.0 * turning[0] * fast - turning[1] * far, 0.0)


@compiled
def _grain(angle: float, strength: float, shape: float) -> float:
    """Friction over its mean for a force at `angle` from the grain's axis of highest friction, exp(strength) to 1.

    Shape 0: an ellipse. Shape 1: a cosine of twice the angle with the same two extremes.
    """
    if shape == 1.0:
        return 1.0 + math.tanh(0.5 * strength) * math.cos(2.0 * angle)
    c, s = math.cos(angle), math.sin(angle)
    return 1.0 / math.sqrt(c * c * math.exp(-strength) + s * s * math.exp(strength))


@compiled
def direction_law(world: World, run: RunFacts, angle: float, yaw: float) -> float:
    """Friction over its mean for a friction force that holds against a pull at `angle` (plate frame)."""
    value = 1.0
    if world.grain_object != 0.0:
        value *= _grain(angle - yaw - world.grain_object_axis, world.grain_object, world.grain_object_shape)
    if world.grain_plate != 0.0:
        value *= _grain(angle - run.mount - world.grain_plate_axis, world.grain_plate, world.grain_plate_shape)
    if world.nap_object != 0.0:
        value *= 1.0 + world.nap_object * math.cos(angle - yaw - world.nap_object_axis)
    if world.nap_plate != 0.0:
        value *= 1.0 + world.nap_plate * math.cos(angle - run.mount - world.nap_plate_axis)
    if world.fourfold != 0.0:
        value *= 1.0 + world.fourfold * math.cos(4.0 * (angle - run.mount - world.fourfold_axis))
    return value


@compiled
def turns_with_direction(world: World) -> bool:
    """True if friction depends on direction at all."""
    return (
        world.grain_object != 0.0
        or world.grain_plate != 0.0
        or world.nap_object != 0.0
        or world.nap_plate != 0.0
        or world.fourfold != 0.0
    )


@compiled
def _patch(world: World, run: RunFacts, x: float, y: float) -> float:
    """Shape 0: one round spot. Shape 1: waves over the whole plate. Both turn with the plate in its mount."""
    c, s = math.cos(run.mount), math.sin(run.mount)
    px, py = c * x + s * y, -s * x + c * y
    if world.patch_shape == 0.0:
        r2 = ((px - world.patch_x) ** 2 + (py - world.patch_y) ** 2) / world.patch_radius**2
        return 1.0 + world.patch * math.exp(-0.5 * r2)
    wave = math.pi / world.patch_radius / 2.0
    return 1.0 + world.patch * math.sin(wave * (px - world.patch_x)) * math.cos(wave * (py - world.patch_y))


@compiled
def _wander(world: World, number: float, x: float, y: float) -> float:
    """A random field of unit variance, anew in every run, with the covariance exp(−distance / length) along any line.

    24 waves with wave numbers of the exponential covariance's spectrum (Rahimi and Recht 2007): in the plane, a Student
    distribution with one degree of freedom, of radius tan-like √(1/q² − 1) / length and even angle.
    """
    total = 0.0
    state = (number + 1.0) * 0.7548776662466927
    for _ in range(24):
        state = (state * 16807.0 + 0.5698402909980532) % 1.0
        q = 0.02 + 0.98 * state
        state = (state * 16807.0 + 0.3247179572447461) % 1.0
        angle = 2.0 * math.pi * state
        state = (state * 16807.0 + 0.8191725133961645) % 1.0
        wave = math.sqrt(1.0 / (q * q) - 1.0) / world.wander_length
        total += math.cos(wave * (x * math.cos(angle) + y * math.sin(angle)) + 2.0 * math.pi * state)
    return total / math.sqrt(12.0)


@compiled
def _wear(world: World, number: float) -> float:
    """Shape 0: runs in exponentially. Shape 1: a straight drift over `wear_runs` runs."""
    if world.wear_shape == 0.0:
        return 1.0 - world.wear * (1.0 - math.exp(-number / world.wear_runs))
    return 1.0 - world.wear * number / world.wear_runs


@compiled
def _beyond_the_catalogue(world: World, run: RunFacts, time_s: float) -> float:
    value = 1.0 + world.damp * (run.humidity - 45.0) / 10.0
    value *= 1.0 + world.echo_length * (run.previous_length - 0.008) / 0.004
    value *= 1.0 + world.tide * math.sin(2.0 * math.pi * time_s / world.tide_s + world.tide_phase)
    if world.echo_direction != 0.0 and not math.isnan(run.previous_azimuth):
        value *= 1.0 + world.echo_direction * math.cos(run.azimuth - run.previous_azimuth)
    return value


@compiled
def level_law(world: World, run: RunFacts, x: float, y: float, pressed: float, time_s: float, speed: float) -> float:
    """Friction force per mass (m/s²) but for direction, age and speed: what the place, the load and the run make it."""
    mu = world.mu * run.draw * _wear(world, run.number) * _beyond_the_catalogue(world, run, time_s)
    if world.patch != 0.0:
        mu *= _patch(world, run, x, y)
    if world.wander != 0.0:
        mu *= math.exp(world.wander * _wander(world, run.number, x, y))
    held = pressed + world.adhesion_n / run.mass
    if world.charge != 0.0:
        held += GRAVITY * world.charge * (1.0 - math.exp(-run.slides_since_handled / world.charge_slides))
    if world.lift != 0.0:
        held *= 1.0 - world.lift * (1.0 - 1.0 / (1.0 + (speed / world.lift_speed) ** 2))
    if world.load_power != 0.0:
        mu *= (max(held, 1e-3) * run.mass / world.load_reference_n) ** (-world.load_power)
    return mu * max(held, 0.0)


@compiled
def age_law(world: World, age_s: float) -> float:
    """Static friction over its value at a contact one second old. Shape 0: logarithm with a cutoff. 1: power law."""
    if world.ageing == 0.0:
        return 1.0
    cutoff = world.ageing_cutoff_s
    decades = math.log10((max(age_s, 0.0) + cutoff) / (1.0 + cutoff))
    if world.ageing_shape == 0.0:
        return max(0.1, 1.0 + world.ageing * decades)
    return math.exp(world.ageing * decades)


@compiled
def speed_law(world: World, speed: float) -> float:
    """Sliding friction over static friction. Fall shape 0: exponential. 1: Lorentzian."""
    value = 1.0 - world.drop
    if world.fall != 0.0:
        ratio = speed / world.fall_speed
        left = math.exp(-ratio) if world.fall_shape == 0.0 else 1.0 / (1.0 + ratio * ratio)
        value *= 1.0 - world.fall * (1.0 - left)
    if world.rate_gain != 0.0:
        value *= 1.0 + world.rate_gain * math.log(1.0 + speed / world.rate_speed)
    return max(value, 0.0)


@compiled
def nearest(world: World, run: RunFacts, yaw: float, radius: float, px: float, py: float) -> tuple[float, float]:
    """The friction that opposes (px, py) most: the point of the friction set nearest to it, itself if it lies inside.

    `radius` is the set's mean radius; the boundary is searched by Newton's method on the angle, from the pull's own.
    """
    size = math.hypot(px, py)
    if size == 0.0:
        return 0.0, 0.0
    angle = math.atan2(py, px)
    edge = radius * direction_law(world, run, angle, yaw)
    if size <= edge:
        return px, py
    if not turns_with_direction(world):
        return px * edge / size, py * edge / size
    step = 1e-3
    at = angle
    for _ in range(12):
        here = _pull(world, run, yaw, radius, px, py, at)
        slope = (
            _pull(world, run, yaw, radius, px, py, at + step) - _pull(world, run, yaw, radius, px, py, at - step)
        ) / (2.0 * step)
        if slope <= 1e-12:
            break
        move = min(max(-here / slope, -0.2), 0.2)
        at += move
        if abs(move) < 1e-7:
            break
    edge = radius * direction_law(world, run, at, yaw)
    return edge * math.cos(at), edge * math.sin(at)


@compiled
def _pull(world: World, run: RunFacts, yaw: float, radius: float, px: float, py: float, angle: float) -> float:
    """Half the derivative of the squared distance from (px, py) to the boundary at `angle`."""
    step = 1e-4
    r = radius * direction_law(world, run, angle, yaw)
    slope = (
        radius
        * (direction_law(world, run, angle + step, yaw) - direction_law(world, run, angle - step, yaw))
        / (2.0 * step)
    )
    c, s = math.cos(angle), math.sin(angle)
    return -((px - r * c) * (slope * c - r * s) + (py - r * s) * (slope * s + r * c))


@compiled
def foam(world: World, x: float, y: float, vx: float, vy: float) -> tuple[float, float]:
    """The pull of the foam's lip (m/s²): a spring and a damper that push the block back inwards, never pull it out."""
    reach = math.hypot(x, y)
    depth = reach - (world.wall_radius - world.foam_width)
    if world.foam_per_s2 == 0.0 or depth <= 0.0:
        return 0.0, 0.0
    ux, uy = x / reach, y / reach
    outward = vx * ux + vy * uy
    push = world.foam_per_s2 * (depth + world.foam_damping_s * outward)
    push = max(push, 0.0)
    return -push * ux, -push * uy


@compiled
def turning_step(world: World, hold: Any, dt: float, v: Any, pull: Any, cx: float, cy: float, radius: float) -> None:
    """One step of a block whose centre of mass lies (cx, cy) off where its friction acts; v (3) and hold (3) change.

    v is the velocity where friction acts and the spin times the sole's turning arm, pull the drive in the same
    coordinates; the friction set is a ball of `radius` in them (an ellipsoidal limit surface), found by projection.
    """
    arm = TURNING_ARM * world.side
    inertia = world.side**2 / 6.0
    w = np.array(
        [
            [1.0 + cy * cy / inertia, -cx * cy / inertia, arm * cy / inertia],
            [-cx * cy / inertia, 1.0 + cx * cx / inertia, -arm * cx / inertia],
            [arm * cy / inertia, -arm * cx / inertia, arm * arm / inertia],
        ]
    )
    largest = 2.0 + (cx * cx + cy * cy) / inertia + arm * arm / inertia
    out = np.zeros(3)
    for _ in range(60):
        for i in range(3):
            out[i] = v[i]
            for j in range(3):
                out[i] += dt * w[i, j] * (pull[j] + hold[j])
        moved = 0.0
        size = 0.0
        for i in range(3):
            new = hold[i] - out[i] / (dt * largest)
            moved = max(moved, abs(out[i]))
            out[i] = new
            size += new * new
        size = math.sqrt(size)
        shrink = radius / size if size > radius else 1.0
        change = 0.0
        for i in range(3):
            change = max(change, abs(out[i] * shrink - hold[i]))
            hold[i] = out[i] * shrink
        if change < 1e-9:
            break
    new_v = np.zeros(3)
    for i in range(3):
        new_v[i] = v[i]
        for j in range(3):
            new_v[i] += dt * w[i, j] * (pull[j] + hold[j])
    for i in range(3):
        v[i] = new_v[i]
