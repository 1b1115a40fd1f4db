"""Blocks on a plate that is tilted in steps about a point beside the told one, by small steps in the world's frame.

Nothing of the diagnosis' mechanics is used: the plate's acceleration is the second difference of its rotation matrix.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shared.geometry import Array
from station.diagnosis.observations.early import FARTHEST_M, GRID_S, Early
from station.diagnosis.observations.plate import Attitude
from station.diagnosis.observations.swing import Swing
from station.physics.contact import GRAVITY_M_S2
from station.physics.reversals import SWINGS

STEP_RAD, LASTS_S, PAUSE_S = math.radians(2.0), 0.25, 0.2
EXACT_S, APART_S, FRAME_S, NOISE_M, REST_S = 2.5e-4, 1e-4, 1 / 90, 5e-6, 0.5
GRAVITY = np.array([0.0, 0.0, -GRAVITY_M_S2])


def tilt_rad(time_s: float) -> float:
    """Smooth steps (the quintic without jerk at its ends), one after another."""
    step, since = divmod(time_s, LASTS_S + PAUSE_S)
    share = min(since / LASTS_S, 1.0)
    return STEP_RAD * (step + share**3 * (10.0 - 15.0 * share + 6.0 * share**2))


def turned(time_s: float) -> Array:
    """The plate's rotation: its x axis goes down."""
    cosine, sine = math.cos(tilt_rad(time_s)), math.sin(tilt_rad(time_s))
    return np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])


def felt(time_s: float, place_m: Array, speed_m_s: float = 0.0) -> Array:
    """Returns the acceleration (3,), m/s², of a block at a place (3,) from the true pivot, in the plate's axes."""
    before, now, after = (turned(time_s + by) for by in (-APART_S, 0.0, APART_S))
    bend, slope = (after - 2.0 * now + before) / APART_S**2, (after - before) / (2.0 * APART_S)
    return now.T @ (GRAVITY - bend @ place_m - 2.0 * slope @ np.array([speed_m_s, 0.0, 0.0]))


@dataclass(frozen=True)
class Slid:
    """A run whose rig took `origin_s` for the slip, in the time of `tilt_rad`; it slipped at `slip_s` from there."""

    run: Early
    origin_s: float
    slip_s: float
    mu: float


def one_run(arm_m: Array, azimuth: float, mu: float, rng: np.random.Generator) -> Slid:
    """A run down the direction `azimuth`, whose plate turns about a point `arm_m` (3,) before the configured one."""
    cosine, sine = math.cos(azimuth), math.sin(azimuth)
    # The arm in axes whose x goes down the slope.
    arm = np.array([cosine * arm_m[0] + sine * arm_m[1], cosine * arm_m[1] - sine * arm_m[0], arm_m[2]])
    time_s = math.atan(mu) / STEP_RAD * (LASTS_S + PAUSE_S) - 1.5
    load = felt(time_s, arm)
    while load[0] < -mu * load[2]:
        time_s += EXACT_S
        load = felt(time_s, arm)
    slip_s, ways, speeds = time_s, [0.0], [0.0]
    while ways[-1] < 1.2 * FARTHEST_M:
        load = felt(time_s, arm + np.array([ways[-1], 0.0, 0.0]), speeds[-1])
        faster = max(speeds[-1] + EXACT_S * (load[0] + mu * load[2]), 0.0)
        ways.append(ways[-1] + 0.5 * EXACT_S * (speeds[-1] + faster))
        speeds.append(faster)
        time_s += EXACT_S
    origin_s = slip_s + rng.uniform(-0.03, 0.03)
    since = slip_s - origin_s + EXACT_S * np.arange(len(ways))
    frames = np.arange(-REST_S + rng.uniform(0.0, FRAME_S), since[-1], FRAME_S)
    path = np.interp(frames, since, ways) + rng.normal(0.0, NOISE_M, len(frames))
    grid = np.arange(frames[0] - GRID_S, frames[-1] + 2 * GRID_S, GRID_S)
    speed = np.interp(grid, since, speeds)
    swing = _by_configured_pivot(origin_s + grid, speed, (cosine, sine))
    pull, press = swing.sliding
    run = Early(
        time_s=frames, path_m=path, sigma_m=NOISE_M, grid_s=grid, pull=pull, press=press,
        tilt_rad=swing.tilt_rad(np.zeros((2, 1))), plate_rad=swing.plate_rad, swing=swing,
    )  # fmt: skip
    return Slid(run, origin_s, slip_s - origin_s, mu)


def _by_configured_pivot(time_s: Array, speed: Array, down: tuple[float, float]) -> Swing:
    """The loads by the configured pivot, on which the block lies."""
    cosine, sine = down
    to_plate = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    resting = np.array([to_plate @ felt(t, np.zeros(3)) for t in time_s])
    sliding = np.array([to_plate @ felt(t, np.zeros(3), v) for t, v in zip(time_s, speed, strict=True)])
    return Swing.of(attitude(time_s, down), np.array(down), sliding=sliding, resting=resting)


def attitude(time_s: Array, down: tuple[float, float]) -> Attitude:
    """The plate at times (m,), by differences of its tilt."""
    cosine, sine = down
    before, tilt, after = (np.array([tilt_rad(t + by) for t in time_s]) for by in (-APART_S, 0.0, APART_S))
    axis = np.array([-sine, cosine, 0.0])
    level = np.sin(tilt)
    return Attitude(
        gravity=np.column_stack([level * cosine, level * sine, -np.cos(tilt)]),
        rate_rad_s=((after - before) / (2 * APART_S))[:, None] * axis,
        acceleration_rad_s2=((after - 2 * tilt + before) / APART_S**2)[:, None] * axis,
        rising=np.ones(len(tilt)),
        gone_rad=np.full(len(tilt), np.inf),
        swing_rad=np.full((len(tilt), SWINGS), np.inf),
        step_s=np.zeros(len(tilt)),
    )
