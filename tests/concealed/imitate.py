# ruff: noqa: PLR0917 (compiled functions take no keyword-only arguments)
"""The recording made elsewhere: a session's commands and starts in a simulator whose contacts are not quite right.

Regularised contacts let a block creep below the critical angle, in proportion to the pull (MuJoCo's law: speed over
acceleration is (1 − d0)/d0 · dw · τ / (2 n impratio), 0.26 ms at its defaults). A pyramidal cone holds a fifth better
along
its axes than between them.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from tests.concealed.compiled import compiled
from tests.concealed.contact import drive, gravity_of
from tests.concealed.ride import holds, slide_step, stop_at_wall
from tests.concealed.session import SessionRecord
from tests.concealed.view import see_mark
from tests.concealed.world import DT_S, FRAME, RunFacts, World

SIMULATED_SIGMA_PX = 0.001
CREEP_S = 2.6e-4
CONE = 0.06
"""Relative swing of the friction over a quarter of a turn; a larger one would not be convex."""

SLOWLY = (0.0, 0.0)
"""Rate and acceleration of the tilt, which a quasi-static simulator leaves out."""


@compiled
def follow(world: World, run: RunFacts, arm: Any, k0: int, start: Any, rest_at: float, creep_s: float) -> Any:
    """The corners (n, 8) at every frame of a run whose arm moves as `arm` (n, 2) says, without noise."""
    frames = np.zeros((len(arm) // FRAME + 2, 8))
    count, corners = 0, np.zeros(8)
    pose, v, hold = start.copy(), np.zeros(3), np.zeros(3)
    sliding = False
    for i in range(len(arm) + 1):
        plate = arm[min(i, len(arm) - 1), 0]
        if (k0 + i) % FRAME == 0:
            gx, gy, _ = gravity_of(world, run.azimuth, plate)
            see_mark(world, pose, v, np.zeros(3), gx, gy, corners)
            frames[count] = corners
            count += 1
        time_s = (k0 + i + 1) * DT_S
        ax, ay, pressed = drive(world, run, pose[0], pose[1], plate, SLOWLY, 0.0, v)
        if not sliding:
            sliding = holds(world, run, pose, ax, ay, pressed, time_s, (k0 + i + 1 - rest_at) * DT_S) > 1.0
        if sliding:
            stopped = slide_step(world, run, pose, v, hold, plate, SLOWLY, time_s, DT_S)
            if stop_at_wall(world, pose, v) or stopped:
                v[:] = 0.0
                sliding = False
        if math.hypot(pose[0], pose[1]) < world.wall_radius:
            pose[0] += DT_S * creep_s * ax
            pose[1] += DT_S * creep_s * ay
    return frames[:count]


def imitation(session: SessionRecord, *, artefact: str) -> SessionRecord:
    """The session as a simulator with `solver_creep` or a `cone_artifact` would have it; friction does not scatter."""
    world = session.setting.world
    if artefact == "cone_artifact":
        world = world._replace(fourfold=CONE)
    creep_s = CREEP_S if artefact == "solver_creep" else 0.0
    runs = []
    for run in session.runs:
        facts = run.facts._replace(draw=1.0, sigma_px=SIMULATED_SIGMA_PX, dropout=0.0)
        corners = follow(world, facts, run.ride.arm, run.from_k, run.start, run.rest_at, creep_s)
        count = len(run.ride.frame_at)
        ride = run.ride._replace(corners_px=corners[:count], found=np.ones(count, dtype=bool))
        runs.append(replace(run, facts=facts, ride=ride))
    return replace(session, runs=tuple(runs))
