# ruff: noqa: PLR0917 (compiled functions take no keyword-only arguments)
"""The compiled kernel of `breakaway`: paths of released blocks, and the likelihood of each moment of slip."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from station.diagnosis.compiled import compiled
from station.physics.contact import Array

STEP_S = 4e-3

ROOT, COUNT = 6e-3, 112
SPEEDS_M_S: Array = np.square(ROOT * np.arange(COUNT))
"""Laws are tabulated at these speeds: finely where blocks break away, and up to 0.44 m/s."""

UNLIKELY = -1e9
"""The log likelihood of a path whose slope by D overflows, as where friction falls steeply at next to no speed. A
moment of slip that is no number would be looked up beyond the tables."""

SPAN, HOLDS, STEEP, BEND, AT, REST, LAG, GUESS_D, FASTER_D, ON, MOVES = range(11)
PARTS = 11
"""The parts of a step: duration, s; what static friction holds, m/s²; slope and curvature of the acceleration by the
speed; the guessed speed's interval of the tables and its share of it; how far the speed ends from the guess, m/s; the
slopes of guess and speed by D; 0 where the guess, and where the speed, stays 0."""


class Laws(NamedTuple):
    """Laws of sliding friction (g, COUNT - 1, 4), as cubics between SPEEDS_M_S; each run (r,) follows one of them."""

    held: Array
    """Ratio of sliding to static friction."""
    slowing_m_s2: Array
    of_run: Any
    spread: float
    """Standard deviation of the runs' random effects on `held`."""
    creep_m: float
    """Standard deviation of the creep before the slip, per relative rise of the tilt's sine."""


def cubics(table: Array) -> Array:
    """The cubics (…, COUNT - 1, 4) through a table, by powers of the share of their interval.

    `table` (…, n) has the values at the n = COUNT speeds SPEEDS_M_S, in a unit of its own. The cubics' slopes are
    continuous (Fritsch & Carlson 1980, SIAM J. Numer. Anal. 17, 238, eq. 1). A path's slope by D follows the law's own
    slope: where that jumps from interval to interval, the likelihood is a staircase.
    """
    width, rise = np.diff(SPEEDS_M_S), np.diff(table)
    slope = np.gradient(table, SPEEDS_M_S, axis=-1, edge_order=2)
    first, last = width * slope[..., :-1], width * slope[..., 1:]
    return np.stack([table[..., :-1], first, 3.0 * rise - 2.0 * first - last, first + last - 2.0 * rise], axis=-1)


class Rows(NamedTuple):
    """Runs (r,), each row padded: pull and press, m/s², on even grids of STEP_S (r, m), and the frames (r, n)."""

    first_s: Array
    pull: Array
    press: Array
    count: Any
    """Number of frames (r,)."""
    time_s: Array
    path_m: Array
    sine: Array
    """Sine of the plate's tilt at the frames (r, n)."""
    sigma_m: Array


@compiled
def log_likelihoods(tried: Any, rows: Any, laws: Any, out: Any) -> None:
    """Writes each moment's log likelihood (r, k) to `out`; place (flat prior), creep and D are integrated out."""
    width = rows.time_s.shape[1]
    shot, crept, steps = np.empty((2, width)), np.empty(width), np.empty((rows.pull.shape[1] + 2, PARTS))
    for run in range(tried.shape[0]):
        size = rows.count[run]
        for m in range(tried.shape[1]):
            begin = shoot(rows, run, tried[run, m], laws, shot, steps)
            columns(rows, run, begin, laws, shot, crept)
            out[run, m] = marginal(shot[0], crept, shot[1], size) - size * np.log(rows.sigma_m[run])


@compiled
def columns(rows: Any, run: int, begin: int, laws: Any, shot: Any, crept: Any) -> None:
    """Writes the creep's column, and makes of a path and its slope by D the residuals and D's column, over the noise.

    `begin` is the first frame after the release.
    """
    left, slope = shot
    sigma = rows.sigma_m[run]
    for i in range(rows.count[run]):
        risen = min(rows.sine[run, i] / rows.sine[run, begin] - 1.0, 0.0) if i < begin else 0.0
        crept[i] = risen * laws.creep_m / sigma
        slope[i] *= laws.spread / sigma
        left[i] = (rows.path_m[run, i] - left[i]) / sigma


@compiled
def shoot(rows: Any, run: int, start: float, laws: Any, shot: Any, steps: Any) -> int:
    """Writes a block's path, released at `start`, and its slope by D at a run's frames; returns the first frame.

    It integrates by Heun's rule from grid point to grid point; friction is looked up once a step, at the rule's guess,
    and continued from there along its slope. The frame returned is the first one after `start`. Each step's row of
    `steps` (m, PARTS) gets what its slopes need.
    """
    pull, press, time, size = rows.pull[run], rows.press[run], rows.time_s[run], rows.count[run]
    held_at, slowed_at = laws.held[laws.of_run[run]], laws.slowing_m_s2[laws.of_run[run]]
    path, slope = shot
    place = (start - rows.first_s[run]) / STEP_S
    node = int(place)
    part = place - node
    pulled = pull[node] + part * (pull[node + 1] - pull[node])
    pressed = press[node] + part * (press[node + 1] - press[node])
    friction = pulled / pressed
    now, speed, way, speed_d, way_d = start, 0.0, 0.0, 0.0, 0.0
    steps[node, HOLDS] = gain_d = pulled
    gain, steep, _ = slowed(held_at[0], slowed_at[0], pulled, 0.0, ROOT * ROOT)
    gain += pulled
    k = 0
    while k < size - 1 and time[k] <= start:
        path[k] = slope[k] = 0.0
        k += 1
    begin = k
    while k < size:
        node += 1
        last = min(node, len(pull) - 1)
        after = rows.first_s[run] + node * STEP_S
        span = after - now
        guess = max(speed + span * gain, 0.0)
        at, rest, width = _interval(guess)
        holds = press[last] * friction
        then, steep_then, bend_then = slowed(held_at[at], slowed_at[at], holds, rest, width)
        then += pull[last]
        faster = speed + 0.5 * span * (gain + then)
        guess_d = speed_d + span * (gain_d + steep * speed_d)
        faster_d = speed_d + 0.5 * span * (gain_d + steep * speed_d + holds + steep_then * guess_d)
        if faster <= 0.0:
            faster = faster_d = 0.0
        step = steps[node]
        step[SPAN], step[HOLDS], step[AT], step[REST] = span, holds, at, rest
        step[STEEP], step[BEND], step[LAG] = steep_then, bend_then, faster - guess
        step[GUESS_D], step[FASTER_D], step[ON], step[MOVES] = guess_d, faster_d, guess > 0.0, faster > 0.0
        bend, bend_d = (faster - speed) / span, (faster_d - speed_d) / span
        while k < size and time[k] <= after:
            since = time[k] - now
            path[k] = way + since * (speed + 0.5 * bend * since)
            slope[k] = way_d + since * (speed_d + 0.5 * bend_d * since)
            k += 1
        way += 0.5 * span * (speed + faster)
        way_d += 0.5 * span * (speed_d + faster_d)
        gain, gain_d, steep = then + steep_then * (faster - guess), holds, steep_then
        speed, speed_d, now = faster, faster_d, after
    return begin


@compiled
def _interval(speed: float) -> tuple[int, float, float]:
    """The interval of the tables that a speed is in, the share of it that is below the speed, and its width, m/s."""
    at = min(int(np.sqrt(speed) / ROOT), COUNT - 2)
    width = ROOT * ROOT * (2 * at + 1)
    return at, (speed - (ROOT * at) ** 2) / width, width


@compiled
def slowed(held: Any, slowing: Any, holds: float, rest: float, width: float) -> tuple[float, float, float]:
    """The acceleration (m/s²) by friction and drag within one interval of the tables, its slope and its curvature."""
    c0, c1 = holds * held[0] + slowing[0], holds * held[1] + slowing[1]
    c2, c3 = holds * held[2] + slowing[2], holds * held[3] + slowing[3]
    steep = c1 + rest * (2.0 * c2 + 3.0 * rest * c3)
    bend = 2.0 * c2 + 6.0 * rest * c3
    return -(c0 + rest * (c1 + rest * (c2 + rest * c3))), -steep / width, -bend / (width * width)


@compiled
def marginal(value: Any, one: Any, two: Any, size: int) -> float:
    """Log likelihood of values (n,): a level, standard Gaussians times columns `one` and `two`, and unit noise.

    It is UNLIKELY where the columns are too large for it.
    """
    level = mean_one = mean_two = 0.0
    for i in range(size):
        level += value[i] / size
        mean_one += one[i] / size
        mean_two += two[i] / size
    square = at_one = at_two = one_two = 0.0
    one_one = two_two = 1.0
    for i in range(size):
        left, first, second = value[i] - level, one[i] - mean_one, two[i] - mean_two
        square += left * left
        at_one += first * left
        at_two += second * left
        one_one += first * first
        one_two += first * second
        two_two += second * second
    volume = one_one * two_two - one_two * one_two
    explained = (two_two * at_one * at_one - 2.0 * one_two * at_one * at_two + one_one * at_two * at_two) / volume
    found = -0.5 * (square - explained + np.log(volume))
    return found if np.isfinite(found) else UNLIKELY
