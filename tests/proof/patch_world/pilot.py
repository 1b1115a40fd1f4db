"""The size of an effect before any recording: pilot runs with and without it, in the generator's own units.

Six pilot runs, spread over the session, are tilted in steps until the block has slid, and again in one smooth motion,
whose slides do not depend on where in a step they begin. What differs is divided by what differs between equal runs:

    onset    spread over the runs of the onset's change (deg) / the scatter of onsets between equal runs
    path     the slide since its onset (mm, root mean square over 0.25 s) / 0.5 mm, more where friction wanders
    rest     what the block seems to move until 0.3 s before its onset (mm) / 0.03 mm, a fifth of a pixel
    turn     the turn during the slide (deg) / 1°
    place    a shift of the whole picture (mm) / 0.05 mm
    shape    the length of the mark's sides at the slide's end (px) / 0.5 px
    angle    reported against true tilt (deg) / 0.2°, which the inclinometer tells

A change of all onsets alike is not counted: a coefficient of friction absorbs it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.proof.patch_world import places as at
from tests.proof.patch_world.bench import Bench
from tests.proof.patch_world.draws import run_draw
from tests.proof.patch_world.effects.base import Effect
from tests.proof.patch_world.seen import Seen, look
from tests.proof.patch_world.world import World

Array = NDArray[np.float64]
RUNS = 6
_FRAME_S = 0.011
_STEP_DEG, _MOST_DEG, _PAUSE_S = 2.0, 46.0, 0.21
_SLIDE_S = np.linspace(0.02, 0.25, 12)
TRIES = 7


@dataclass(frozen=True, kw_only=True)
class Pilots:
    """Pilot runs: `stepped` as in a session, and `smooth`, the same in one motion."""

    stepped: list[Seen]
    smooth: list[Seen]


def pilot_runs(world: World, *, seed: int, runs: int, count: int | None = None) -> Pilots:
    """The pilot runs of a world, the same for worlds that differ in an effect only."""
    pick = np.random.default_rng([seed, 7])
    count = count or RUNS
    numbers = [1 + (k * runs) // count + int(pick.integers(max(runs // count, 1))) for k in range(count)]
    return Pilots(
        stepped=[_pilot(world, seed=seed, run=run, step_deg=_STEP_DEG) for run in numbers],
        smooth=[_pilot(world, seed=seed, run=run, step_deg=_MOST_DEG) for run in numbers],
    )


def _pilot(world: World, *, seed: int, run: int, step_deg: float) -> Seen:
    rng = np.random.default_rng([seed, run, 3])
    x, y = rng.uniform(-0.015, 0.015, 2)
    yaw, azimuth, before = rng.uniform(0.0, 2 * math.pi, 3)
    rate, dwell = math.radians(rng.choice([6.0, 14.0])), math.exp(rng.uniform(math.log(0.6), math.log(6.0)))
    bench = Bench(world)
    bench.state[at.T] = 10.0 * run
    bench.place(x, y, yaw)
    bench.begin_run(run_draw(world, seed=seed, run=run), run=run, azimuth=azimuth, before=before)
    bench.state[at.AGE] = dwell
    bench.motion[at.AZIMUTH] = azimuth
    states = [bench.state.copy()]
    next_s, angle = bench.time_s, 0.0
    while math.hypot(bench.state[at.X] - x, bench.state[at.Y] - y) < 0.012:
        if bench.time_s >= next_s:
            if angle >= _MOST_DEG:
                break
            angle += step_deg
            next_s = bench.ask(math.radians(angle), azimuth=azimuth, rate=rate) + _PAUSE_S
        bench.advance(round(bench.time_s + _FRAME_S, 4))
        states.append(bench.state.copy())
    return look(world, states, azimuth=azimuth, run=run)


def sizes(world: World, with_it: Pilots, without: Pilots) -> dict[str, float]:
    """The differences between pilot runs with and without an effect, in the units above."""
    pairs = list(zip(with_it.stepped, without.stepped, strict=True))
    smooth = zip(with_it.smooth, without.smooth, strict=True)
    onsets = np.array([one.onset_deg - other.onset_deg for one, other in pairs])
    onsets = onsets[np.isfinite(onsets)]
    mu = world.contact.mu
    scatter = math.degrees(world.scatter.run_sd * mu / (1 + mu * mu))
    slides = np.array([one.slide_mm(_SLIDE_S) - other.slide_mm(_SLIDE_S) for one, other in smooth])
    found = {
        "onset": float(onsets.std()) / scatter if len(onsets) > 1 else 0.0,
        "path": _rms(slides) / (0.5 * (1 + world.scatter.wander_sd / 0.03)),
        "rest": _rms([_creep_mm(one) - _creep_mm(other) for one, other in pairs]) / 0.03,
        "turn": _rms([_turn_deg(one) - _turn_deg(other) for one, other in pairs]) / 1.0,
        "place": float(np.std([one.mark_mm[0] - other.mark_mm[0] for one, other in pairs], axis=0).max()) / 0.05,
        "shape": _rms(np.array([one.sides_px[-1] - other.sides_px[-1] for one, other in pairs])) / 0.5,
        "angle": _rms([(one.tilt_deg - one.true_deg).mean() - (o.tilt_deg - o.true_deg).mean() for one, o in pairs])
        / 0.2,
    }
    return {name: round(value, 3) for name, value in found.items()}


def _rms(values: Array | list[float]) -> float:
    kept = np.asarray(values)[np.isfinite(values)]
    return float(np.sqrt(np.mean(kept**2))) if kept.size else 0.0


def _creep_mm(seen: Seen) -> float:
    """Returns how far the block seems to have moved until 0.3 s before its onset."""
    end = seen.time_s[-1] if math.isnan(seen.onset_s) else seen.onset_s - 0.3
    last = max(int(np.searchsorted(seen.time_s, end)) - 1, 0)
    return float(np.hypot(*(seen.path_mm[last] - seen.path_mm[0])))


def _turn_deg(seen: Seen) -> float:
    return float((seen.yaw_deg[-1] - seen.yaw_deg[0] + 180) % 360 - 180)


def strength_for(
    effect: Effect, world: World, *, seed: int, runs: int, wanted: float
) -> tuple[float, World, dict[str, float]]:
    """The strength at which the largest of an effect's sizes is as wanted, by bisection of its logarithm.

    Returns:
        The strength, the world with it, and its sizes; the strongest that is physical where that does not do.
    """
    without = pilot_runs(world, seed=seed, runs=runs)

    def size(found: dict[str, float]) -> float:
        return found[effect.shows] if effect.shows else max(found.values())

    def tried(strength: float) -> tuple[World, dict[str, float]]:
        changed = effect.change(world, strength, np.random.default_rng([seed, 4]))
        return changed, sizes(world, pilot_runs(changed, seed=seed, runs=runs), without)

    low, high = math.log(effect.most / 300), math.log(effect.most)
    changed, found = tried(effect.most)
    if size(found) > wanted:
        for _ in range(TRIES):
            middle = 0.5 * (low + high)
            changed, found = tried(math.exp(middle))
            low, high = (low, middle) if size(found) > wanted else (middle, high)
        changed, found = tried(math.exp(high))
    return math.exp(high), changed, found
