"""A session on paper for plans without a recording: onsets and slides as the paper's protocol would place them."""

from __future__ import annotations

import math

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.likelihood.noise import Noise
from station.diagnosis.next_experiment.redone import STANDARD_RATE_RAD_S, Draw, Recorded
from station.diagnosis.observations.channel import Rows, rows_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.moments import Moments, RunFacts
from station.diagnosis.observations.onsets import Onsets
from station.diagnosis.observations.plate import Attitude, Times
from station.diagnosis.observations.slides import Across, Along, Motion, Turn
from station.physics.contact import GRAVITY_M_S2, Array
from station.physics.covariates import covariates_of
from station.physics.reversals import SWINGS

RUNS = 120
SLIDE_POINTS = 4
NAMES = ("onset", "along", "across", "turn")
NOISE = Noise(
    friction=0.1,
    own={"onset": 0.04, "along": 0.02, "across": 0.002, "turn": 0.3},
    factor=dict.fromkeys(NAMES, 1.0),
    tail=dict.fromkeys(NAMES, thresholds.GAUSSIAN),
)
"""A typical rig's noise: friction scatters by a tenth from run to run."""


def standard(rng: np.random.Generator, runs: int) -> Draw:
    """Returns the paper's protocol.

    It has four directions, one dwell, one tilt rate, and the block always in about the same heading.
    """
    quarter = rng.integers(0, 4, runs)
    return {
        "down": quarter * math.pi / 2,
        "x": rng.normal(0, 0.012, runs),
        "y": rng.normal(0, 0.012, runs),
        "yaw": rng.normal(0, 0.03, runs),
        "mount": np.zeros(runs),
        "mass_kg": np.full(runs, 0.008),
        "rate": np.full(runs, STANDARD_RATE_RAD_S),
        "dwell_s": np.full(runs, 4.0),
        "number": np.arange(runs, dtype=np.float64),
    }


def on_paper(draw: Draw, *, mu_s: float) -> Recorded:
    """Returns a session with a protocol (runs,) on a plate with this friction, without any effect or noise."""
    runs = len(draw["number"])
    tilt = math.atan(mu_s)
    facts = RunFacts(
        number=draw["number"],
        rest_ns=-np.round((draw["dwell_s"] + tilt / draw["rate"]) * 1e9).astype(np.int64),
        dwell_s=draw["dwell_s"],
        mount_rad=draw["mount"],
        mass_kg=draw["mass_kg"],
        area_m2=np.full(runs, 1e-4),
        temperature_c=np.full(runs, np.nan),
        relative_humidity=np.full(runs, np.nan),
    )
    channels = (_onsets(draw, facts, mu_s), *_slides(draw, facts, mu_s))
    recorded = Recorded.of(Evidence(channels=channels, run_number=draw["number"], facts=facts, total_runs=runs))
    assert recorded is not None
    return recorded


def _attitude(draw: Draw, tilt: Array, run: Times, delay_s: float) -> Attitude:
    rate, down = draw["rate"][run], draw["down"][run]
    tilt = tilt - rate * delay_s
    gravity = np.column_stack([np.sin(tilt) * np.cos(down), np.sin(tilt) * np.sin(down), -np.cos(tilt)])
    axis = np.column_stack([-np.sin(down), np.cos(down), np.zeros(len(down))])
    still, alike = np.zeros((len(down), 3)), np.ones(len(down))
    unknown = np.full((len(down), SWINGS), np.inf)
    return Attitude(gravity, axis * rate[:, None], still, alike, np.inf * alike, unknown, 0.1 * alike)


def _moments(draw: Draw, facts: RunFacts, tilt: Array, run: Times, *, speed: Array, time_ns: Times) -> Moments:
    way = np.column_stack([np.cos(draw["down"][run]), np.sin(draw["down"][run])])
    return Moments(
        time_ns=time_ns,
        run=run,
        facts=facts,
        attitude=lambda delay_s: _attitude(draw, tilt, run, delay_s),
        place_m=np.column_stack([draw["x"][run], draw["y"][run]]) + way * (speed**2)[:, None],
        yaw_rad=draw["yaw"][run],
        velocity_m_s=speed[:, None] * way,
        moving=speed > 0,
        slip_ns=np.zeros(len(run), dtype=np.int64),
        border_m=np.full(len(run), np.inf),
    )


def _rows(run: Times, sigma: float, moments: Moments, every: int) -> Rows:
    none = np.zeros(len(run), dtype=np.int64)
    known = {name: values[every // 2 :: every] for name, values in covariates_of(moments.reported).items()}
    return rows_of({"run": run, "from_ns": none, "to_ns": none, "sigma": np.full(len(run), sigma)}, known)


def _onsets(draw: Draw, facts: RunFacts, mu_s: float) -> Onsets:
    runs = len(draw["number"])
    run, still = np.arange(runs), np.zeros(runs)
    moments = _moments(
        draw, facts, np.full(runs, math.atan(mu_s)), run, speed=still, time_ns=np.zeros(runs, dtype=np.int64)
    )
    return Onsets(_rows(run, 0.003, moments, 1), moments)


def _slides(draw: Draw, facts: RunFacts, mu_s: float) -> tuple[Along, Across, Turn]:
    """Gives a few windows of each slide, from slow to fast, at speeds that grow with the cube root of the tilt rate."""
    count = len(draw["number"])
    runs = np.repeat(np.arange(count), SLIDE_POINTS)
    share = np.tile((np.arange(SLIDE_POINTS) + 0.5) / SLIDE_POINTS, count)
    run = np.repeat(runs, 3)
    speed = np.repeat(0.12 * share * np.cbrt(draw["rate"][runs] / STANDARD_RATE_RAD_S), 3)
    tilt = math.atan(mu_s) + np.repeat(0.03 * share, 3)
    time_ns = np.round(np.repeat(0.5 * share, 3) * 1e9).astype(np.int64)
    moments = _moments(draw, facts, tilt, run, speed=speed, time_ns=time_ns)
    gained = GRAVITY_M_S2 * (np.sin(tilt) - mu_s * np.cos(tilt))[1::3]
    way = np.column_stack([np.cos(draw["down"][runs]), np.sin(draw["down"][runs])])
    motion = Motion(moments, gained[:, None] * way, np.zeros(len(runs)))
    own = _rows(runs, 0.006, moments, 3)
    return Along(own, motion), Across(own, motion), Turn(_rows(runs, 0.8, moments, 3), motion)
