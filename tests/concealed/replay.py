# ruff: noqa: PLR0917, PLR0912, PLR0915 (compiled functions take no keyword-only arguments, and the loop is one)
"""Goes through a run once more in another world: what would have been different with the same arm and onset.

The onset is held fixed by giving the run the friction that it would have needed. That friction, and the path after the
onset, are smooth in every parameter, which the moment of slipping is not when the tilt comes in steps.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tests.concealed.compiled import compiled
from tests.concealed.contact import drive, gravity_of, shaking, true_tilt
from tests.concealed.ride import against_wall, holds, presliding, slide_step, stop_at_wall
from tests.concealed.view import see_mark
from tests.concealed.world import DT_S, FRAME, RunFacts, World

INNER = 2
LASTING = 90
"""Substeps: 0.1 s."""


@compiled
def replay(
    world: World, run: RunFacts, arm: Any, k0: int, tilt_k: int, onset_k: float, end_k: int, rest_k: float, start: Any,
    slower: float = 1.0,
) -> tuple[float, float, Any, Any]:  # fmt: skip
    """The friction needed over the run's own, and that of pulls that last; corners and tilt at every frame.

    Frames are those from tilt_k to end_k: corners (n, 8), the plate's own tilt (n).

    `slower` multiplies the friction while sliding. `arm` (n, 2) is the reported tilt and its acceleration from
    substep k0 on.
    """
    first = ((tilt_k + FRAME - 1) // FRAME) * FRAME
    count = max((end_k - first) // FRAME + 1, 0)
    seen, plates = np.zeros((count, 8)), np.zeros(count)
    corners = np.zeros(8)
    pose, v, hold, shift = start.copy(), np.zeros(3), np.zeros(3), np.zeros(2)
    was_v, gain = np.zeros(3), np.zeros(3)
    plate, was, before, needed = 0.0, 0.0, 0.0, 0.0
    slip_k = math.ceil(onset_k)
    shares = np.zeros((max(slip_k - tilt_k + 2, 1), 3))
    loads = 0
    sliding, stop_k, stopped_load = False, 0, 0.0
    # First pass: how much friction the run needs to hold until its onset, and no longer.
    for k in range(k0, min(slip_k, k0 + len(arm))):
        was = plate
        plate = _follow(world, plate, arm[k - k0, 0])
        if k + 1 < tilt_k:
            continue
        shaken = shaking(world, run, (k + 1) * DT_S)
        turning = ((plate - was) / DT_S, arm[k - k0, 1])
        ax, ay, pressed = drive(world, run, pose[0], pose[1], plate, turning, shaken, v)
        load = holds(world, run, pose, ax, ay, pressed, (k + 1) * DT_S, (k + 1 - rest_k) * DT_S)
        if k + 1 == slip_k:
            load = before + (load - before) * (onset_k - k)
        before = load
        needed = max(needed, load)
        shares[loads, 0], shares[loads, 1], shares[loads, 2] = load, ax, ay
        loads += 1
    # Second pass: what the camera sees, with that friction.
    plate = 0.0
    for k in range(k0, min(end_k + 1, k0 + len(arm))):
        if k >= first and k % FRAME == 0:
            at = (k - first) // FRAME
            gx, gy, _ = gravity_of(world, run.azimuth, plate)
            shown = pose.copy()
            shown[0] += shift[0]
            shown[1] += shift[1]
            see_mark(world, shown, v, gain, gx, gy, corners)
            seen[at], plates[at] = corners, plate
        was = plate
        plate = _follow(world, plate, arm[k - k0, 0])
        slid_for = 0.0
        was_v[:] = v
        gain[:] = 0.0
        turning = ((plate - was) / DT_S, arm[k - k0, 1])
        if sliding:
            slid_for = DT_S
        elif k + 1 == slip_k:
            sliding, slid_for = True, (k + 1 - onset_k) * DT_S
            pose[0] += shift[0]
            pose[1] += shift[1]
            shift[:] = 0.0
        elif world.presliding_m != 0.0 and k + 1 < slip_k and k + 1 >= tilt_k:
            load, ax, ay = shares[k + 1 - tilt_k, 0], shares[k + 1 - tilt_k, 1], shares[k + 1 - tilt_k, 2]
            size = math.hypot(ax, ay)
            far = presliding(world, load / max(needed, 1e-9), (k + 1 - tilt_k) * DT_S)
            if size > 0.0:
                shift[0], shift[1] = far * ax / size, far * ay / size
        elif k + 1 > slip_k:  # it has stopped: it may slip again
            ax, ay, pressed = drive(
                world, run, pose[0], pose[1], plate, turning, shaking(world, run, (k + 1) * DT_S), v
            )
            ax, ay = against_wall(world, pose, ax, ay)
            load = holds(world, run, pose, ax, ay, pressed, (k + 1) * DT_S, (k + 1 - stop_k) * DT_S) / needed
            if load > 1.0:
                sliding = True
                slid_for = DT_S * min(1.0, (load - 1.0) / max(load - stopped_load, 1e-12))
            stopped_load = min(load, 1.0)
        for inner in range(INNER if slid_for > 0.0 else 0):
            share = (inner + 0.5) / INNER
            tilt = plate - (plate - was) * (1.0 - share) * slid_for / DT_S
            at_s = (k + 1) * DT_S - (1.0 - share) * slid_for
            stopped = slide_step(world, run, pose, v, hold, tilt, turning, at_s, slid_for / INNER, needed * slower)
            if stop_at_wall(world, pose, v) or stopped:
                v[:] = 0.0
                sliding = False
                stop_k, stopped_load = k + 1, 0.0
                break
        if sliding and slid_for > 0.0:
            gain[:] = (v - was_v) / slid_for
    return needed, _sustained(shares[:loads, 0]), seen, plates


@compiled
def _sustained(loads: Any) -> float:
    """The largest mean of the load over a tenth of a second: a shorter excess moves the block by micrometres only."""
    if len(loads) <= LASTING:
        return loads.mean() if len(loads) else 0.0
    total = loads[:LASTING].sum()
    largest = total
    for i in range(LASTING, len(loads)):
        total += loads[i] - loads[i - LASTING]
        largest = max(largest, total)
    return largest / LASTING


@compiled
def _follow(world: World, plate: float, reported: float) -> float:
    wanted = true_tilt(world, reported)
    return min(max(plate, wanted - 0.5 * world.play), wanted + 0.5 * world.play)


__all__ = ["against_wall", "replay"]
