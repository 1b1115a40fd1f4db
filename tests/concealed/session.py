"""A whole session: the machine's choices, run after run, on a block that starts where it last stopped."""

from __future__ import annotations

import math
from collections import defaultdict
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from tests.concealed.compiled import one_process_compiles
from tests.concealed.design import PAIRS, Design, Nuisance, Setting
from tests.concealed.ride import Ride, ride
from tests.concealed.view import CENTRE_PX, IMAGE_PX
from tests.concealed.world import BASE_HZ, DT_S, FRAME, Program, RunFacts, World

Array = NDArray[np.float64]
START_K = 2 * BASE_HZ
"""Substep of the first run; the sync move lies before it."""
_FREE_CHOICES = 72
_HAND_S = 0.3


@dataclass(frozen=True, eq=False, kw_only=True)
class RunRecord:
    """One run as it was done: the facts that went in, the machine's choices, and what came out."""

    facts: RunFacts
    program: Program
    angles: Array
    direction: int
    sector: int
    previous: int
    start: Array
    rest_at: float
    handled: bool
    from_k: int
    ride: Ride
    humidity: float
    temperature: float

    @property
    def censored(self) -> bool:
        """True if no slip was detected."""
        return bool(self.ride.marks[1] < 0)


@dataclass(frozen=True, eq=False, kw_only=True)
class SessionRecord:
    """All runs of a session, in order."""

    setting: Setting
    runs: tuple[RunRecord, ...]
    sync: Array
    """Reported tilt (rad) at each substep before the first run: the small move that camera and arm both see."""


class _Machine:
    """The choices that the sampling machine makes."""

    def __init__(self, design: Design, rng: Generator) -> None:
        self._design, self._rng = design, rng
        self._onsets: defaultdict[int, list[float]] = defaultdict(list)

    def direction(self, place: Array, world: World) -> tuple[int, float]:
        """A direction's number (−1: free) and azimuth, at random by the distance that the block has left there."""
        design = self._design
        if design.free:
            options = [(-1, 2.0 * math.pi * i / _FREE_CHOICES) for i in range(_FREE_CHOICES)]
        else:
            options = [(number, 0.5 * math.pi * number) for number in design.directions]
        room = np.array([_room_px(place, azimuth, world) for _, azimuth in options])
        if design.shuttle:
            return options[int(np.argmax(room))]
        usable = np.where(room >= design.min_slide_px, room, 0.0)
        if not usable.any():
            usable = np.where(room >= room.max() - 1e-9, np.maximum(room, 1e-6), 0.0)
        return options[int(self._rng.choice(len(options), p=usable / usable.sum()))]

    def angles(self, sector: int) -> Array:
        """The tilts to try."""
        design, known = self._design, self._onsets[sector]
        if not design.adapt_after or len(known) < max(design.adapt_after, 2):
            return np.radians(np.linspace(0.0, design.wide_deg, design.wide_steps + 1)[1:])
        mean, spread = float(np.mean(known)), 3.0 * float(np.std(known, ddof=1))
        low, high = max(mean - spread, 0.0), min(mean + spread, math.radians(67.5))
        steps = np.linspace(low, high, design.steps + 1)
        return steps if low > 0 else steps[1:]

    def learn(self, sector: int, onset: float) -> None:
        """One more slip."""
        self._onsets[sector].append(onset)


def _room_px(place: Array, azimuth: float, world: World) -> float:
    """Returns how far a block at `place` (m) can slide before the image's border or the wall, in pixels."""
    du, dv = math.sin(azimuth), math.cos(azimuth)
    u, v = CENTRE_PX + world.px_per_m * place[0], CENTRE_PX - world.px_per_m * place[1]
    rooms = [
        ((IMAGE_PX - 1 - at) if step > 0 else at) / abs(step) for at, step in ((u, du), (v, dv)) if abs(step) > 1e-9
    ]
    along = place[0] * du - place[1] * dv
    across2 = max(0.0, float(place @ place) - along * along)
    wall = math.sqrt(max(world.wall_radius**2 - across2, 0.0)) - along
    return max(0.0, min(*rooms, wall * world.px_per_m))


def _draws(nuisance: Nuisance, runs: int, rng: Generator) -> Array:
    """Each run's friction over the mean."""
    if math.isinf(nuisance.tail):
        z = rng.standard_normal(runs)
    else:
        z = rng.standard_t(nuisance.tail, runs) * math.sqrt((nuisance.tail - 2.0) / nuisance.tail)
    return np.exp(np.clip(nuisance.scatter * z, -1.2, 1.2) - 0.5 * nuisance.scatter**2)


def _in_blocks(values: tuple[float, ...], runs: int, rng: Generator) -> Array:
    """Values that change every so often, each as often as the others, in random order."""
    count = len(values) if len(values) == 1 else max(len(values) * 3, 6)
    order = np.concatenate([rng.permutation(len(values)) for _ in range(-(-count // len(values)))])[:count]
    return np.asarray(values, dtype=float)[order[np.minimum(np.arange(runs) * count // runs, count - 1)]]


def _air(runs: int, rng: Generator) -> tuple[Array, Array]:
    """Temperature (°C) and relative humidity (%) of each run: slow random walks."""
    steps = rng.standard_normal((2, runs)) * np.array([[0.05], [1.2]])
    walk = np.zeros((2, runs))
    for i in range(1, runs):
        walk[:, i] = 0.985 * walk[:, i - 1] + steps[:, i]
    return 21.5 + walk[0], np.clip(45.0 + walk[1], 15.0, 85.0)


def run_session(setting: Setting, rng: Generator) -> SessionRecord:
    """Does all runs of a session. The same setting and generator give the same session."""
    design, nuisance, world = setting.design, setting.nuisance, setting.world
    machine = _Machine(design, rng)
    draws = _draws(nuisance, design.runs, rng)
    masses, mounts = _in_blocks(design.masses, design.runs, rng), _in_blocks(design.mounts_deg, design.runs, rng)
    temperature, humidity = _air(design.runs, rng)
    cube_kg = PAIRS[design.pair][3]
    pose = np.array([*rng.uniform(-0.004, 0.004, 2), rng.uniform(-math.pi, math.pi) if design.yaw_varies else 0.0])
    k, rest_at, previous = START_K, float(START_K - BASE_HZ), -1
    previous_azimuth, previous_length, since_handled = math.nan, 0.008, 0
    records: list[RunRecord] = []
    for i in range(design.runs):
        changed = i > 0 and (masses[i] != masses[i - 1] or mounts[i] != mounts[i - 1])
        handled = changed or (design.handled_every > 0 and i > 0 and i % design.handled_every == 0)
        hand = 0
        if handled:
            pose = _put_back(pose, design, world, rng)
            hand = _substeps(_HAND_S)
            rest_at, since_handled = float(k + hand), 0
        number, azimuth = machine.direction(pose[:2], world)
        sector = round(azimuth / (math.pi / 2)) % 4
        angles = machine.angles(sector)
        rate = float(design.rates_deg_s[int(rng.integers(len(design.rates_deg_s)))])
        share = 1.0 - i / max(design.runs - 1, 1) if design.dwell_falls else rng.random()
        dwell = design.dwell_s[0] * (design.dwell_s[1] / design.dwell_s[0]) ** share
        program = Program(
            dwell=hand + _substeps(dwell),
            hidden=hand,
            rate=math.radians(rate),
            return_rate=math.radians(design.return_deg_s),
            acceleration=math.radians(design.acceleration_deg_s2),
            hold=_substeps(design.hold_s),
            base_px=design.base_px,
            per_deg_px=design.per_deg_px,
        )
        knocked = rng.random() < nuisance.knocks
        facts = RunFacts(
            number=float(i),
            draw=float(draws[i]),
            mass=float(masses[i]) * cube_kg,
            azimuth=azimuth,
            mount=math.radians(mounts[i]),
            previous_azimuth=previous_azimuth,
            previous_length=previous_length,
            slides_since_handled=float(since_handled),
            humidity=float(humidity[i]),
            shake_phase=float(rng.uniform(0.0, 2.0 * math.pi)),
            knock_at_s=float(rng.uniform(0.3, 2.0)) if knocked else math.inf,
            knock_speed=float(rng.uniform(0.25, 0.4)),
            knock_azimuth=float(rng.uniform(0.0, 2.0 * math.pi)),
            sigma_px=nuisance.noise_px * (1.0 + nuisance.noise_drift * i / max(design.runs - 1, 1)),
            dropout=nuisance.dropouts,
        )
        with nullcontext() if records else one_process_compiles():
            done = _trimmed(ride(world, facts, program, angles, k, pose, rest_at, rng))
        records.append(
            RunRecord(
                facts=facts, program=program, angles=angles, direction=number, sector=sector, previous=previous,
                start=pose, rest_at=rest_at, handled=handled, from_k=k, ride=done,
                humidity=float(humidity[i]), temperature=float(temperature[i]),
            )
        )  # fmt: skip
        if not records[-1].censored:
            machine.learn(sector, float(done.truths[1]))
        previous_length = float(np.hypot(*(done.pose[:2] - pose[:2])))
        pose, k, rest_at = done.pose, int(done.marks[4]) + 1, float(done.truths[3])
        previous, previous_azimuth, since_handled = number, azimuth, since_handled + 1
    return SessionRecord(setting=setting, runs=tuple(records), sync=_sync_move())


def _substeps(seconds: float) -> int:
    return round(seconds * BASE_HZ)


def _put_back(pose: Array, design: Design, world: World, rng: Generator) -> Array:
    """Returns the pose at which a hand puts the block: somewhere in the inner part of the plate."""
    reach = 0.55 * world.wall_radius * math.sqrt(rng.random())
    if design.handled_every == 1 and len(design.directions) == 1 and not design.free:
        # One direction only: uphill of the centre, so that there is room.
        beta = 0.5 * math.pi * design.directions[0]
        centre = -0.35 * world.wall_radius * np.array([math.sin(beta), -math.cos(beta)])
        reach *= 0.5
    else:
        centre = np.zeros(2)
    turn = rng.uniform(0.0, 2.0 * math.pi)
    yaw = rng.uniform(-math.pi, math.pi) if design.yaw_varies else pose[2]
    return np.array([*(centre + reach * np.array([math.cos(turn), math.sin(turn)])), yaw])


def _trimmed(done: Ride) -> Ride:
    """A ride with arrays as long as what they hold, so that a session fits into memory."""
    cut: dict[str, Any] = {}
    for names, count in (
        (("frame_at", "corners_px", "found", "tips", "down"), done.frames),
        (("attitude_at", "tilt", "tilt_rate"), done.attitudes),
        (("reading_at", "reading_tilt"), done.readings),
        (("step_at", "step_angle"), done.steps),
    ):
        cut |= {name: getattr(done, name)[:count].copy() for name in names}
    cut["arm"] = done.arm.copy()
    return done._replace(**cut)


def _sync_move() -> Array:
    """Up to 2° and back within the 2 s before the first run."""
    t = np.arange(START_K) * DT_S
    return math.radians(2.0) * np.sin(np.pi * np.clip((t - 0.4) / 1.2, 0.0, 1.0)) ** 2


__all__ = ["FRAME", "RunRecord", "SessionRecord", "run_session"]
