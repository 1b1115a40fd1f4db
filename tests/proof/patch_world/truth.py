"""The truth of where an effect acted: each run again without it, with the same begin, commands and draws.

A run without the effect may not have slid yet when the recorded one went back to level; for its onset alone the steps
of the tilt then go on as before.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.proof.patch_world import places as at
from tests.proof.patch_world.bench import Bench
from tests.proof.patch_world.draws import run_draw
from tests.proof.patch_world.seen import Seen, look
from tests.proof.patch_world.session import Asked, RunRecord
from tests.proof.patch_world.world import World

Array = NDArray[np.float64]
_SINCE_S = np.linspace(0.02, 0.3, 15)
_FURTHER_STEPS = 12
_FRAME_S = 0.011
Benches = Callable[[World], Bench]
"""Makes the bench of a world."""


def acted(
    world: World, without: World, records: Sequence[RunRecord], *, seed: int, bench_of: Benches = Bench
) -> list[dict[str, Any]]:
    """Returns what an effect did in each run of a session of `world`, against `without` it, on a bench of its own.

    Returns:
        A table for each run: `onset_deg`, the change of the onset as the arm's angles tell it (None where one of both
        did not slide), `slide_mm`, the change of the slide since its onset (root mean square over 0.3 s), and for the
        `phases` rest, slide and return from when to when (s since the session's begin), by how much at most the block's
        path and yaw since the phase began (mm, deg), the fiducial (mm), the reported tilt (deg), and what an
        inclinometer has beside that (deg) differ. Of the fiducial's difference, `fiducial_begin_mm` is there as the
        phase begins, at rest on a level plate, and `fiducial_moved_mm` comes as the plate tilts.
    """
    return [_of_run(world, without, record, seed=seed, bench_of=bench_of) for record in records if record.states]


def _of_run(world: World, without: World, record: RunRecord, *, seed: int, bench_of: Benches) -> dict[str, Any]:
    azimuth, run = record.azimuth, record.run
    one = look(world, record.states, azimuth=azimuth, run=run)
    times = one.time_s
    states = again(without, record, times, record.asked, seed=seed, bench_of=bench_of)
    other = look(without, states, azimuth=azimuth, run=run)
    onset_deg = other.onset_deg
    if math.isnan(onset_deg):
        longer = _further(record)
        until = np.arange(times[0], longer[-1].time_s + 1.0, _FRAME_S)
        states = again(without, record, until, longer, seed=seed, bench_of=bench_of)
        onset_deg = look(without, states, azimuth=azimuth, run=run).onset_deg
    slides = one.slide_mm(_SINCE_S) - other.slide_mm(_SINCE_S)
    kept = slides[np.isfinite(slides)]
    return {
        "run": run,
        "onset_s": _number(one.onset_s, 4),
        "onset_deg": _number(one.onset_deg - onset_deg, 4),
        "slide_mm": _number(float(np.sqrt(np.mean(kept**2))), 4) if kept.size else None,
        "phases": {name: _window(one, other, low, high) for name, low, high in _phases(one, other, record)},
    }


def again(
    world: World, record: RunRecord, times: Array, asked: Sequence[Asked], *, seed: int, bench_of: Benches = Bench
) -> list[Array]:
    """The states (n) of a run in a world at times (s), with the motions that were asked for."""
    bench = bench_of(world)
    bench.state[at.T] = record.begin.state[at.T]
    bench.begin_run(
        run_draw(world, seed=seed, run=record.run), run=record.run, azimuth=record.azimuth, before=record.before
    )
    bench.resume(record.begin)
    bench.motion[at.AZIMUTH] = record.azimuth
    waiting, states = list(asked), list[Array]()
    for time_s in times:
        while waiting and waiting[0].time_s <= time_s:
            motion = waiting.pop(0)
            bench.advance(motion.time_s)
            bench.ask(motion.angle, azimuth=motion.azimuth, rate=motion.rate)
        bench.advance(float(time_s))
        states.append(bench.state.copy())
    return states


def _further(record: RunRecord) -> list[Asked]:
    """The tilt's motions without the return, and more steps of the same size and pace."""
    tilts = [one for one in record.asked if one.angle > 0]
    if len(tilts) < 2:
        return tilts
    last, before = tilts[-1], tilts[-2]
    step, pace = last.angle - before.angle, last.time_s - before.time_s
    more = [
        Asked(time_s=last.time_s + k * pace, angle=last.angle + k * step, azimuth=last.azimuth, rate=last.rate)
        for k in range(1, _FURTHER_STEPS + 1)
    ]
    return [*tilts, *(one for one in more if one.angle < 1.2)]


def _phases(one: Seen, other: Seen, record: RunRecord) -> list[tuple[str, float, float]]:
    begin, end, detect = float(one.time_s[0]), float(one.time_s[-1]), record.detect_s or float(one.time_s[-1])
    onset = min(x for x in (one.onset_s, other.onset_s, detect) if not math.isnan(x))
    rest = min(x for x in (one.rests_until_s, other.rests_until_s, detect) if not math.isnan(x))
    return [("rest", begin, rest), ("slide", onset, detect), ("return", detect, end)]


def _window(one: Seen, other: Seen, low: float, high: float) -> dict[str, Any]:
    inside = (one.time_s >= low) & (one.time_s <= high)
    found: dict[str, Any] = {"from_s": round(low, 4), "to_s": round(high, 4)}
    if inside.any():
        turn = (one.yaw_deg - other.yaw_deg + 180) % 360 - 180
        found["path_mm"] = _number(_most(_moved(one.path_mm - other.path_mm, inside)), 5)
        found["yaw_deg"] = _number(_most(_moved(turn[:, None], inside)), 4)
        marks = one.mark_mm - other.mark_mm
        found["fiducial_mm"] = _number(_most(marks[inside]), 5)
        found["fiducial_begin_mm"] = _number(_most(marks[inside][:1]), 5)
        found["fiducial_moved_mm"] = _number(_most(_moved(marks, inside)), 5)
        found["tilt_deg"] = _number(_most((one.tilt_deg - other.tilt_deg)[inside, None]), 5)
        found["level_deg"] = _number(_most((one.level_deg - other.level_deg)[inside]), 5)
    return found


def _moved(apart: Array, inside: NDArray[np.bool_]) -> Array:
    """Differences (n, k) inside a phase, since it began: a lens shifts a block that lies still, which nobody sees."""
    return apart[inside] - apart[inside][0]


def _most(apart: Array) -> float:
    return float(np.linalg.norm(apart, axis=1).max())


def _number(value: float, digits: int) -> float | None:
    return None if math.isnan(value) else round(value, digits)
