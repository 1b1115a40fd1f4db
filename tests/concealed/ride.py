# ruff: noqa: PLR0917, PLR0912, PLR0915 (compiled functions take no keyword-only arguments, and the loop is one)
"""One run of the rig, from level to level: arm, block, camera and the machine's slip rule, compiled.

The arm moves in trapezoids of speed. The block sticks until the pull leaves the friction set: that moment is located
within the substep, as is every stop; between these events it slides by Moreau's implicit midpoint step. The machine
watches noisy pixels, so that what it does depends on the noise, as with a real rig.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from tests.concealed.compiled import compiled
from tests.concealed.contact import (
    age_law,
    direction_law,
    drive,
    foam,
    gravity_of,
    level_law,
    nearest,
    shaking,
    speed_law,
    true_tilt,
    turning_step,
)
from tests.concealed.view import see_mark, tip_over
from tests.concealed.world import ATTITUDE, DT_S, FRAME, SENSOR, TURNING_ARM, Program, RunFacts, World

INNER = 2
"""Steps of the slide within a substep."""
COMMAND_DELAY = 9
"""Substeps from a command to the motion's begin: 10 ms."""
REFERENCE_FRAMES = 10
DWELL, REFERENCE, TILT, RETURN, AFTER = 0, 1, 2, 3, 4
TIP_PER_S2 = 400.0
"""The rate at which a tilted-over block falls further: g over the distance from its edge to its centre of mass."""
TIPPED_RAD = 0.4
"""The tracker calls the mark foreshortened from this angle on."""
REST_AFTER = 180
"""Substeps on the level plate before the run is done."""


class Ride(NamedTuple):
    """The record of a run. Moments are substeps of the session; the first counts say how much of each array holds.

    `marks` are moments: tilt begun, detected (−1: censored), return asked for, level again, done. `truths`: onset
    (substeps, a fraction), reported tilt there, reported tilt at the end of the tilting, moment of the last stop.
    `arm` (n, 2) is reported tilt and its acceleration in every substep, for those who go through the run once more.
    """

    frames: int
    attitudes: int
    readings: int
    steps: int
    frame_at: Any
    corners_px: Any
    found: Any
    tips: Any
    down: Any
    attitude_at: Any
    tilt: Any
    tilt_rate: Any
    reading_at: Any
    reading_tilt: Any
    step_at: Any
    step_angle: Any
    arm: Any
    marks: Any
    truths: Any
    touched: bool
    tipped: bool
    pose: Any


@compiled
def _toward(angle: float, rate: float, target: float, limit: float, acceleration: float) -> tuple[float, float, float]:
    """One substep of the arm towards a target: angle, rate, acceleration."""
    left = target - angle
    wanted = math.copysign(min(limit, math.sqrt(1.8 * acceleration * abs(left))), left)
    change = min(max(wanted - rate, -acceleration * DT_S), acceleration * DT_S)
    new = rate + change
    if abs(left) <= abs(new) * DT_S + 2e-6 and abs(new) <= 2.0 * acceleration * DT_S:
        return target, 0.0, -rate / DT_S
    return angle + 0.5 * (rate + new) * DT_S, new, change / DT_S


@compiled
def holds(
    world: World, run: RunFacts, pose: Any, ax: float, ay: float, pressed: float, time_s: float, age_s: float
) -> float:
    """The pull over what the contact can hold: above 1 the block slips."""
    angle = math.atan2(ay, ax)
    radius = level_law(world, run, pose[0], pose[1], pressed, time_s, 0.0) * age_law(world, age_s)
    edge = radius * direction_law(world, run, angle, pose[2])
    size = math.hypot(ax, ay)
    if world.uneven_x != 0.0 or world.uneven_y != 0.0:
        c, s = math.cos(pose[2]), math.sin(pose[2])
        cx, cy = s * world.uneven_y - c * world.uneven_x, -s * world.uneven_x - c * world.uneven_y
        size = math.hypot(size, (cx * ay - cy * ax) / (TURNING_ARM * world.side))
    return size / max(edge, 1e-9)


@compiled
def against_wall(world: World, pose: Any, ax: float, ay: float) -> tuple[float, float]:
    """The pull on a block that rests against the plate's wall: what points outwards the wall takes."""
    reach = math.hypot(pose[0], pose[1])
    if reach < world.wall_radius - 1e-7:
        return ax, ay
    ux, uy = pose[0] / reach, pose[1] / reach
    out = max(ax * ux + ay * uy, 0.0)
    return ax - out * ux, ay - out * uy


@compiled
def slide_step(
    world: World, run: RunFacts, pose: Any, v: Any, hold: Any, tilt: float, turning: Any, time_s: float, dt: float,
    more: float = 1.0,
) -> bool:  # fmt: skip
    """Moves a sliding block by dt; whether it has come to rest. `v` is (m/s, m/s, rad/s), `more` times the friction.

    `turning` are the tilt's rate and acceleration.
    """
    ax, ay, pressed = drive(world, run, pose[0], pose[1], tilt, turning, shaking(world, run, time_s), v)
    fx, fy = foam(world, pose[0], pose[1], v[0], v[1])
    ax, ay = against_wall(world, pose, ax + fx, ay + fy)
    speed = math.hypot(v[0] + 0.5 * dt * (ax + hold[0]), v[1] + 0.5 * dt * (ay + hold[1]))
    radius = level_law(world, run, pose[0], pose[1], pressed, time_s, speed) * more
    radius *= speed_law(world, speed)
    old_x, old_y, old_w = v[0], v[1], v[2]
    if world.uneven_x != 0.0 or world.uneven_y != 0.0:
        c, s = math.cos(pose[2]), math.sin(pose[2])
        cx, cy = s * world.uneven_y - c * world.uneven_x, -s * world.uneven_x - c * world.uneven_y
        arm = TURNING_ARM * world.side
        pull = np.array([ax, ay, (cx * ay - cy * ax) / arm])
        v[2] *= arm
        # A block that is just let go has no friction yet whose direction could be asked: it will be against the pull.
        against = math.atan2(-hold[1], -hold[0]) if math.hypot(hold[0], hold[1]) > 0.0 else math.atan2(ay, ax)
        edge = radius * direction_law(world, run, against, pose[2])
        turning_step(world, hold, dt, v, pull, cx, cy, edge)
        v[2] /= arm
    else:
        px, py = v[0] / dt + ax, v[1] / dt + ay
        hx, hy = nearest(world, run, pose[2], radius, px, py)
        slow = 1.0 + world.drag_per_s * dt
        v[0], v[1] = dt * (px - hx) / slow, dt * (py - hy) / slow
        hold[0], hold[1] = -hx, -hy
    pose[0] += 0.5 * dt * (old_x + v[0])
    pose[1] += 0.5 * dt * (old_y + v[1])
    pose[2] += 0.5 * dt * (old_w + v[2])
    return math.hypot(v[0], v[1]) < 1e-9 and abs(v[2]) < 1e-6


@compiled
def stop_at_wall(world: World, pose: Any, v: Any) -> bool:
    """Stops a block that has reached the wall, where it is; whether it has."""
    reach = math.hypot(pose[0], pose[1])
    if reach < world.wall_radius:
        return False
    if v[0] * pose[0] + v[1] * pose[1] <= 0.0:
        return False
    # Back along the path to the wall, rather than straight inwards.
    speed2 = v[0] * v[0] + v[1] * v[1]
    along = (pose[0] * v[0] + pose[1] * v[1]) / speed2
    back = along - math.sqrt(max(along * along - (reach * reach - world.wall_radius**2) / speed2, 0.0))
    pose[0], pose[1] = pose[0] - back * v[0], pose[1] - back * v[1]
    v[:] = 0.0
    return True


@compiled
def first_tip(world: World, azimuth: float, yaw: float) -> float:
    """The smallest tilt at which the vertical through the block's mass leaves its sole, over any of its four edges."""
    first = math.inf
    if world.tips_at == math.inf:
        return first
    downhill = math.atan2(-math.cos(azimuth), math.sin(azimuth)) - yaw
    for quarter in range(4):
        edge = 0.5 * math.pi * quarter
        lean = math.cos(downhill - edge)
        if lean > 1e-9:
            inside = 0.5 * world.side - world.mass_x * math.cos(edge) - world.mass_y * math.sin(edge)
            first = min(first, math.atan(math.tan(world.tips_at) * inside / (0.5 * world.side * lean)))
    return first


@compiled
def presliding(world: World, load: float, held_s: float) -> float:
    """Displacement (m) below onset. Shape 0: elastic, stiff at first. Shape 1: creep, with the logarithm of time."""
    if world.presliding_m == 0.0:
        return 0.0
    share = min(load, 1.0)
    if world.presliding_shape == 0.0:
        return world.presliding_m * share / (2.0 - share)
    return world.presliding_m * share**3 * math.log1p(held_s / 0.3) / 2.0


@compiled
def _far_corners(corners: Any, reference: Any, limit: float) -> int:
    far = 0
    for i in range(4):
        far += math.hypot(corners[2 * i] - reference[2 * i], corners[2 * i + 1] - reference[2 * i + 1]) > limit
    return far


@compiled
def ride(
    world: World, run: RunFacts, program: Program, angles: Any, k0: int, start: Any, rest_at: float, rng: Any
) -> Ride:
    """One run from substep k0, of a block at `start` (x, y, yaw) that has rested since substep `rest_at`."""
    longest = int(program.dwell + 900 * 3 + len(angles) * (program.hold + 400) + 900 * 90)
    n_frame, n_attitude, n_reading = longest // FRAME + 2, longest // ATTITUDE + 2, longest // SENSOR + 2
    frame_at, corners_px = np.zeros(n_frame, np.int64), np.zeros((n_frame, 8))
    found, down, tips = np.zeros(n_frame, np.bool_), np.zeros((n_frame, 2)), np.zeros(n_frame, np.bool_)
    attitude_at, tilts, rates = np.zeros(n_attitude, np.int64), np.zeros(n_attitude), np.zeros(n_attitude)
    reading_at, reading_tilt = np.zeros(n_reading, np.int64), np.zeros(n_reading)
    step_at, step_angle = np.zeros((len(angles) + 1, 3), np.int64), np.zeros(len(angles) + 1)
    marks, truths = np.full(5, -1, np.int64), np.full(4, np.nan)
    frames, attitudes, readings, steps = 0, 0, 0, 0
    arm = np.zeros((longest, 2))

    pose, v, hold, hidden_shift = start.copy(), np.zeros(3), np.zeros(3), np.zeros(2)
    was_v, gain = np.zeros(3), np.zeros(3)
    reference, reference_count, corners = np.zeros(8), 0, np.zeros(8)
    phase, phase_at, target, limit = DWELL, k0, 0.0, program.rate
    motion_at, hold_at, motion_done = k0, k0, True
    angle, rate, spin_up, plate = 0.0, 0.0, 0.0, 0.0
    sliding, touched, tipped, knocked = False, False, False, False
    tip, tip_rate = 0.0, 0.0
    tipped_frames = 0
    before = 0.0
    last_stop = rest_at
    k = k0
    while True:
        time_s = k * DT_S
        # --- the frame, as it is at this moment ---
        if k % FRAME == 0:
            gx, gy, _ = gravity_of(world, run.azimuth, plate)
            shown = pose.copy()
            shown[0] += hidden_shift[0]
            shown[1] += hidden_shift[1]
            see_mark(world, shown, v, gain, gx, gy, corners)
            if tip > 0.0:
                tip_over(world, run.azimuth, pose, tip, corners)
            for i in range(8):
                corners[i] += run.sigma_px * rng.standard_normal()
            seen = k - k0 >= program.hidden and rng.random() >= run.dropout
            frame_at[frames], found[frames], down[frames, 0], down[frames, 1] = k, seen, gx, gy
            corners_px[frames], tips[frames] = corners, tip > TIPPED_RAD
            frames += 1
            if phase == DWELL and k - phase_at >= program.dwell:
                phase, phase_at = REFERENCE, k
            elif phase == REFERENCE and seen:
                reference += corners / REFERENCE_FRAMES
                reference_count += 1
                if reference_count == REFERENCE_FRAMES:
                    phase, phase_at = TILT, k
                    marks[0] = k
                    target, motion_at, motion_done = angles[0], k + COMMAND_DELAY, False
                    step_at[0, 0], step_angle[0] = k, target
                    steps = 1
            elif phase == TILT and seen:
                tipped_frames = tipped_frames + 1 if tip > TIPPED_RAD else 0
                over = _far_corners(corners, reference, program.base_px + program.per_deg_px * math.degrees(angle))
                if tipped_frames >= 5 or (over >= 3 and tip == 0.0):
                    marks[1] = k if tip == 0.0 else -1
                    tipped = tip > 0.0
                    phase, phase_at = RETURN, k
                elif motion_done and k - hold_at >= program.hold:
                    if steps < len(angles):
                        target, motion_at, motion_done = angles[steps], k + COMMAND_DELAY, False
                        step_at[steps, 0], step_angle[steps] = k, target
                        steps += 1
                    else:
                        phase, phase_at = RETURN, k
                if phase == RETURN:
                    truths[2] = angle
                    # The machine waits for the attitude of the frame's own stamp, which comes late if that is late.
                    back = k + (round(max(world.late_s, 0.0) / DT_S) if marks[1] >= 0 else 0)
                    marks[2] = back
                    if not motion_done:
                        step_at[steps - 1, 2] = back + COMMAND_DELAY
                    if motion_at > k:  # never begun: it begins and is replaced at once
                        step_at[steps - 1, 1] = back + COMMAND_DELAY
                    target, motion_at, motion_done, limit = 0.0, back + COMMAND_DELAY, False, program.return_rate
            elif phase == RETURN and motion_done and k - hold_at >= REST_AFTER:
                marks[4] = k
        # --- attitude and another sensor's view of it ---
        if k % ATTITUDE == 0:
            attitude_at[attitudes], tilts[attitudes], rates[attitudes] = k, angle, rate
            attitudes += 1
        if k % SENSOR == 0:
            reading_at[readings], reading_tilt[readings] = k, plate
            readings += 1
        if marks[4] >= 0:
            break
        # --- the arm ---
        if k >= motion_at and not motion_done:
            if phase == TILT and k == motion_at:
                step_at[steps - 1, 1] = k
            angle, rate, spin_up = _toward(angle, rate, target, limit, program.acceleration)
            if rate == 0.0 and angle == target:
                motion_done, hold_at = True, k + 1
                if phase == TILT:
                    step_at[steps - 1, 2] = k + 1
                elif phase == RETURN:
                    marks[3] = k + 1
        elif not motion_done and rate != 0.0:  # the motion that is about to be replaced goes on
            step = step_angle[steps - 1] if steps else 0.0
            angle, rate, spin_up = _toward(angle, rate, step, program.rate, program.acceleration)
        else:
            spin_up = 0.0
        arm[k - k0, 0], arm[k - k0, 1] = angle, spin_up
        was_plate = plate
        wanted = true_tilt(world, angle)
        # A play operator: the plate follows only when the play is used up.
        plate = min(max(plate, wanted - 0.5 * world.play), wanted + 0.5 * world.play)
        k += 1
        level = phase in (DWELL, REFERENCE)
        if level and world.presliding_m == 0.0 and world.level_x == 0.0 and world.level_y == 0.0:
            continue
        # --- the block ---
        time_s = k * DT_S
        if not knocked and marks[0] >= 0 and (k - marks[0]) * DT_S >= run.knock_at_s:
            knocked = True
            if phase == TILT:
                v[0] += run.knock_speed * math.cos(run.knock_azimuth)
                v[1] += run.knock_speed * math.sin(run.knock_azimuth)
                if not sliding:
                    sliding = True
                    truths[0], truths[1] = float(k), angle
        slid_for = 0.0
        was_v[:] = v
        gain[:] = 0.0
        turning = ((plate - was_plate) / DT_S, spin_up)
        if not sliding:
            ax, ay, pressed = drive(world, run, pose[0], pose[1], plate, turning, shaking(world, run, time_s), v)
            ax, ay = against_wall(world, pose, ax, ay)
            load = holds(world, run, pose, ax, ay, pressed, time_s, (k - last_stop) * DT_S)
            tips_at = first_tip(world, run.azimuth, pose[2])
            if phase == TILT and plate > tips_at and load <= 1.0:
                tip_rate += TIP_PER_S2 * (tip + plate - tips_at) * DT_S
                tip = min(tip + tip_rate * DT_S, 1.2)
            elif phase == RETURN and tip > 0.0:
                tip, tip_rate = max(0.0, tip - 3.0 * DT_S), 0.0
            if load > 1.0 and tip == 0.0:
                share = (1.0 - before) / (load - before) if load > before else 0.0
                share = min(max(share, 0.0), 1.0)
                slid_for = (1.0 - share) * DT_S
                sliding = True
                if phase == TILT:
                    truths[0], truths[1] = k - 1 + share, angle - rate * slid_for
                pose[0] += hidden_shift[0]
                pose[1] += hidden_shift[1]
                hidden_shift[:] = 0.0
                hold[:] = 0.0
            elif world.presliding_m != 0.0 and math.isnan(truths[0]):
                size = math.hypot(ax, ay)
                far = presliding(world, load, max(0.0, (k - marks[0]) * DT_S) if marks[0] >= 0 else 0.0)
                if size > 0.0:
                    hidden_shift[0], hidden_shift[1] = far * ax / size, far * ay / size
            before = load
        else:
            slid_for = DT_S
        if sliding and slid_for > 0.0:
            for inner in range(INNER):
                share = (inner + 0.5) / INNER
                tilt = plate - (plate - was_plate) * (1.0 - share) * slid_for / DT_S
                at = time_s - (1.0 - share) * slid_for
                stopped = slide_step(world, run, pose, v, hold, tilt, turning, at, slid_for / INNER)
                if stop_at_wall(world, pose, v):
                    touched = True
                    stopped = True
                if stopped:
                    v[:] = 0.0
                    sliding = False
                    last_stop = float(k)
                    before = 0.0
                    break
            if sliding:
                gain[:] = (v - was_v) / slid_for
    truths[3] = last_stop
    return Ride(
        frames, attitudes, readings, steps, frame_at, corners_px, found, tips, down, attitude_at, tilts, rates,
        reading_at, reading_tilt, step_at, step_angle, arm[: k - k0], marks, truths, touched, tipped, pose,
    )  # fmt: skip
