"""A synthetic session for planning: onsets and slides as a protocol would place them, without any effect or noise."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.inference.fit import Fit, fit
from station.diagnosis.likelihood.noise import Noise
from station.diagnosis.observations.channel import Rows, rows_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.moments import Moments, RunFacts
from station.diagnosis.observations.onsets import Onsets
from station.diagnosis.observations.plate import Attitude, Times
from station.diagnosis.observations.slides import Across, Along, Motion, Turn
from station.physics.contact import GRAVITY_M_S2, Array
from station.physics.model import Model

TRIAL_RUNS = 120
SLIDE_POINTS = 4
FEWEST_RECORDED = 20
STANDARD_RATE_RAD_S, LEAST_RATE_RAD_S = math.radians(5.0), math.radians(0.5)
Draw = dict[str, Array]
Protocol = Callable[[np.random.Generator, int], Draw]
"""Draws a session's numbers, (runs,) each by name."""

Vary = Callable[[np.random.Generator, int, Draw], None]
"""Changes a protocol's numbers, (runs,) each by name, in place."""


def standard(rng: np.random.Generator, runs: int) -> Draw:
    """The paper's protocol: four directions, one dwell, one tilt rate, the block always in about the same heading."""
    quarter = rng.integers(0, 4, runs)
    return {
        "down": quarter * math.pi / 2,
        "x": rng.normal(0, 0.012, runs),
        "y": rng.normal(0, 0.012, runs),
        "yaw": rng.normal(0, 0.03, runs),
        "mount": np.zeros(runs),
        "mass_kg": np.full(runs, 0.008),
        "rate": np.full(runs, STANDARD_RATE_RAD_S),
        "rest_s": np.full(runs, 8.0) * np.exp(rng.normal(0, 0.02, runs)),
        "number": np.arange(runs, dtype=np.float64),
    }


@dataclass(frozen=True, eq=False, kw_only=True)
class Bench:
    """The rig of a synthetic session: its friction, its noise (a typical one by default), and its protocol.

    A plan changes one thing of the protocol; what else varies together in it (a dwell that falls with the runs) goes on
    doing so.
    """

    mu_s: float = 0.4
    noise: Noise | None = None
    protocol: Protocol = standard


def as_recorded(evidence: Evidence) -> Protocol:
    """The protocol that a recording's onsets show, its runs in their order; the standard one if it has too few."""
    onset = evidence.channel("onset")
    if not isinstance(onset, Onsets) or len(onset.moments) < FEWEST_RECORDED:
        return standard
    at = onset.moments.reported

    def protocol(rng: np.random.Generator, runs: int) -> Draw:
        del rng
        chosen = np.linspace(0, len(at) - 1, runs).round().astype(np.int64)
        order = np.argsort(at.run, kind="stable")[chosen]
        rate = np.linalg.norm(at.rate_rad_s[order], axis=1)
        known = {
            "down": at.down_rad[order],
            "x": at.x_m[order],
            "y": at.y_m[order],
            "yaw": at.yaw_rad[order],
            "mount": at.mount_rad[order],
            "mass_kg": at.mass_kg[order],
            # A plate that holds at the onset has no rate.
            "rate": np.where(rate > LEAST_RATE_RAD_S, rate, STANDARD_RATE_RAD_S),
            "rest_s": at.rest_s[order],
            "number": at.run[order],
        }
        return {name: np.nan_to_num(values) for name, values in known.items()}

    return protocol


def trial(vary: Vary, bench: Bench) -> tuple[Evidence, Fit]:
    """A synthetic session of TRIAL_RUNS runs with the protocol that `vary` changes, and the plain model's fit to it."""
    rng = np.random.default_rng(7)
    runs, mu_s = TRIAL_RUNS, bench.mu_s
    draw = bench.protocol(rng, runs)
    vary(rng, runs, draw)
    facts = RunFacts(
        number=draw["number"],
        rest_ns=-np.round(draw["rest_s"] * 1e9).astype(np.int64),
        mount_rad=draw["mount"],
        mass_kg=draw["mass_kg"],
        area_m2=np.full(runs, 1e-4),
        temperature_c=np.full(runs, np.nan),
        relative_humidity=np.full(runs, np.nan),
    )
    channels = (_onsets(draw, facts, mu_s), *_slides(draw, facts, mu_s))
    trial = Evidence(channels=channels, run_number=draw["number"], facts=facts, total_runs=runs)
    return trial, fit(trial, Model(mu_s=mu_s), (), noise=_noise(bench.noise), refine=False, steps=1)


def _noise(noise: Noise | None) -> Noise:
    names = ("onset", "along", "across", "turn")
    if noise is None:
        own = {"onset": 0.04, "along": 0.02, "across": 0.002, "turn": 0.3}
        return Noise(
            friction=0.1, own=own, factor=dict.fromkeys(names, 1.0), tail=dict.fromkeys(names, thresholds.GAUSSIAN)
        )
    return Noise(
        friction=noise.friction,
        own={name: noise.own.get(name, 0.02) for name in names},
        factor={name: noise.factor.get(name, 1.0) for name in names},
        tail=dict.fromkeys(names, thresholds.GAUSSIAN),
    )


def _attitude(draw: Draw, tilt: Array, place: Times, delay_s: float) -> Attitude:
    rate, down = draw["rate"][place], draw["down"][place]
    tilt = tilt - rate * delay_s
    gravity = np.column_stack([np.sin(tilt) * np.cos(down), np.sin(tilt) * np.sin(down), -np.cos(tilt)])
    axis = np.column_stack([-np.sin(down), np.cos(down), np.zeros(len(down))])
    return Attitude(
        gravity, axis * rate[:, None], np.zeros((len(down), 3)), np.ones(len(down)), np.full(len(down), 0.1)
    )


def _moments(draw: Draw, facts: RunFacts, tilt: Array, place: Times, *, speed: Array, time_ns: Times) -> Moments:
    way = np.column_stack([np.cos(draw["down"][place]), np.sin(draw["down"][place])])
    return Moments(
        time_ns=time_ns,
        run=place,
        facts=facts,
        attitude=lambda delay_s: _attitude(draw, tilt, place, delay_s),
        place_m=np.column_stack([draw["x"][place], draw["y"][place]]) + way * (speed**2)[:, None],
        yaw_rad=draw["yaw"][place],
        velocity_m_s=speed[:, None] * way,
        moving=speed > 0,
        slip_ns=np.zeros(len(place), dtype=np.int64),
        border_m=np.full(len(place), np.inf),
    )


def _rows(run: Times, sigma: float) -> Rows:
    count = len(run)
    none = np.zeros(count, dtype=np.int64)
    return rows_of({"run": run, "from_ns": none, "to_ns": none, "sigma": np.full(count, sigma)}, {})


def _onsets(draw: Draw, facts: RunFacts, mu_s: float) -> Onsets:
    place = np.arange(TRIAL_RUNS)
    tilt = np.full(TRIAL_RUNS, math.atan(mu_s))
    moments = _moments(
        draw, facts, tilt, place, speed=np.zeros(TRIAL_RUNS), time_ns=np.zeros(TRIAL_RUNS, dtype=np.int64)
    )
    return Onsets(_rows(place, 0.003), moments)


def _slides(draw: Draw, facts: RunFacts, mu_s: float) -> tuple[Along, Across, Turn]:
    """A few windows of each slide, from slow to fast, at speeds that grow with the root of the tilt rate."""
    runs = np.repeat(np.arange(TRIAL_RUNS), SLIDE_POINTS)
    share = np.tile((np.arange(SLIDE_POINTS) + 0.5) / SLIDE_POINTS, TRIAL_RUNS)
    place = np.repeat(runs, 3)
    speed = np.repeat(0.12 * share * np.sqrt(draw["rate"][runs] / math.radians(5.0)), 3)
    excess = np.repeat(0.03 * share, 3)
    tilt = math.atan(mu_s) + excess
    time_ns = np.round(np.repeat(0.5 * share, 3) * 1e9).astype(np.int64)
    moments = _moments(draw, facts, tilt, place, speed=speed, time_ns=time_ns)
    middle = slice(1, None, 3)
    gained = GRAVITY_M_S2 * (np.sin(tilt) - mu_s * np.cos(tilt))[middle]
    way = np.column_stack([np.cos(draw["down"][runs]), np.sin(draw["down"][runs])])
    motion = Motion(moments, gained[:, None] * way, np.zeros(len(runs)))
    return Along(_rows(runs, 0.006), motion), Across(_rows(runs, 0.006), motion), Turn(_rows(runs, 0.8), motion)
