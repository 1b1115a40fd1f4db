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


class Laws(NamedTuple):
    """Laws of sliding friction (g, COUNT) at SPEEDS_M_S, and which of them each run (r,) follows."""

    held: Array
    """Ratio of sliding to static friction."""
    slowing_m_s2: Array
    of_run: Any
    spread: float
    """Standard deviation of the runs' random effects on `held`."""
    creep_m: float
    """Standard deviation of the creep before the slip, per relative rise of the tilt's sine."""


class Rows(NamedTuple):
    """Runs (r), each row padded: pull and press, m/s², on even grids of STEP_S (r, m), and the frames (r, n)."""

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
    shot, crept = np.empty((2, width)), np.empty(width)
    left, slope = shot
    for run in range(tried.shape[0]):
        size, sigma = rows.count[run], rows.sigma_m[run]
        for m in range(tried.shape[1]):
            begin = _shoot(rows, run, tried[run, m], laws, shot)
            for i in range(size):
                risen = min(rows.sine[run, i] / rows.sine[run, begin] - 1.0, 0.0) if i < begin else 0.0
                crept[i] = risen * laws.creep_m / sigma
                slope[i] *= laws.spread / sigma
                left[i] = (rows.path_m[run, i] - left[i]) / sigma
            out[run, m] = _marginal(left, crept, slope, size) - size * np.log(sigma)


@compiled
def _shoot(rows: Any, run: int, start: float, laws: Any, shot: Any) -> int:
    """Writes a block's path, released at `start`, and its slope by D at a run's frames; returns the first frame.

    It integrates by Heun's rule from grid point to grid point; friction is looked up once a step, at the rule's guess,
    and continued from there along its slope. The frame returned is the first one after `start`.
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
    held, falls, slowed, slows = _looked_up(0.0, held_at, slowed_at)
    gain = pulled - pressed * friction * held - slowed
    gain_d, steep = pressed * friction, -pressed * friction * falls - slows
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
        held, falls, slowed, slows = _looked_up(guess, held_at, slowed_at)
        holds = press[last] * friction
        then, steep_then = pull[last] - holds * held - slowed, -holds * falls - slows
        faster = speed + 0.5 * span * (gain + then)
        faster_d = speed_d + 0.5 * span * (
            gain_d + steep * speed_d + holds + steep_then * (speed_d + span * (gain_d + steep * speed_d))
        )
        if faster <= 0.0:
            faster = faster_d = 0.0
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
def _looked_up(speed: float, held: Any, slowed: Any) -> tuple[float, float, float, float]:
    """The ratio of sliding to static friction and the other deceleration (m/s²), each with its slope by the speed."""
    at = min(int(np.sqrt(speed) / ROOT), COUNT - 2)
    low = (ROOT * at) ** 2
    width = ROOT * ROOT * (2 * at + 1)
    falls, slows = (held[at + 1] - held[at]) / width, (slowed[at + 1] - slowed[at]) / width
    return held[at] + falls * (speed - low), falls, slowed[at] + slows * (speed - low), slows


@compiled
def _marginal(value: Any, one: Any, two: Any, size: int) -> float:
    """Log likelihood of values (n,): a level, standard Gaussians times columns `one` and `two`, and unit noise."""
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
    return -0.5 * (square - explained + np.log(volume))
