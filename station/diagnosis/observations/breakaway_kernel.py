# ruff: noqa: PLR0917 (compiled functions take no keyword-only arguments)
"""The compiled kernel of `breakaway`: the paths of a block that is released at some moments, and their slopes.

The moments of a run are followed side by side, from grid point to grid point: a step is a long chain of operations, and
while one waits for another, a processor goes on with the next moment's. One after another they took 1.5 times as long.

The slopes of a path by the numbers of a law follow the differentiated steps of its integration (the variational
equation; Hairer, Nørsett & Wanner 1993, I.14), which are linear.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from station.compiled import compiled
from station.diagnosis.observations.breakaway_tables import COUNT, ROOT, STEP_S

SPEED, WAY, GAIN, SPEED_D, WAY_D, GAIN_D, STEEP, FRICTION, NOW = range(9)
"""The parts of a state: speed, m/s, way, m, acceleration, m/s², and their slopes by D; and for the path alone the slope
of the acceleration by the speed, 1/s, the ratio of pull and press at the release, and the time, s."""

FROM, AT, RISE, FROM_D, AT_D, RISE_D, SINCE, SPAN = range(8)
"""The parts of a step: way, m, and speed, m/s, when it begins, by how much the speed rises, m/s, and their slopes by D;
and for the path alone the time when it begins, and how long it takes, s."""


class Shot(NamedTuple):
    """Holds the paths of blocks released at k moments, and the slopes of these by q numbers, at n frames.

    `ways` (k, q + 1, n), m, have the path before its slopes, and `bends` the slopes of these by D. `begin` (k,) is the
    first frame after each moment, and `node` (k,) the grid point before it. `states` (k, q + 1, 9) are those at the
    grid point that has been reached, and `steps` (k, q + 1, 8) those that end there.
    """

    ways: Any
    bends: Any
    begin: Any
    node: Any
    states: Any
    steps: Any


@compiled
def room(moments: int, numbers: int, frames: int) -> Any:
    """Makes room for a `Shot`."""
    rows = numbers + 1
    return Shot(
        np.zeros((moments, rows, frames)), np.zeros((moments, rows, frames)),
        np.zeros(moments, np.int64), np.zeros(moments, np.int64),
        np.zeros((moments, rows, NOW + 1)), np.zeros((moments, rows, SPAN + 1)),
    )  # fmt: skip


@compiled
def shoot(rows: Any, run: int, starts: Any, laws: Any, along: Any, shot: Any) -> None:
    """Writes to `shot` the paths, at a run's frames, of blocks released at `starts` (k,), s.

    It integrates by Heun's rule from grid point to grid point; friction is looked up once a step, at the rule's guess,
    and continued from there along its slope.
    """
    pull, press, time, size = rows.pull[run], rows.press[run], rows.time_s[run], rows.count[run]
    of_run, count, first_s = laws.of_run[run], len(starts), rows.first_s[run]
    law = laws.held[of_run], laws.slowing_m_s2[of_run], along.held[:, of_run], along.slowing_m_s2[:, of_run]
    ways, bends, begin, nodes, states, steps = shot
    for m in range(count):
        nodes[m] = _release(pull, press, first_s, starts[m], law, states[m])
        begin[m] = _stand(time, size, starts[m], ways[m], bends[m])
    node, frame = nodes.min(), begin.min()
    while frame < size:
        node += 1
        last, after = min(node, len(pull) - 1), first_s + node * STEP_S
        _step(pull[last], press[last], node, after, law, nodes, states, steps)
        while frame < size and time[frame] <= after:
            for m in range(count):
                if begin[m] <= frame:
                    _look(time[frame], steps, m, ways, bends, frame)
            frame += 1


@compiled
def _release(pull: Any, press: Any, first_s: float, start: float, law: Any, states: Any) -> int:
    """Writes the state at the release; returns the grid point before it, by the times that `shoot` gives them."""
    held, slowing, by_held, by_slowing = law
    place = (start - first_s) / STEP_S
    node = int(place)
    if first_s + node * STEP_S > start:
        node -= 1
    if first_s + (node + 1) * STEP_S <= start:
        node += 1
    part = place - node
    pulled = pull[node] + part * (pull[node + 1] - pull[node])
    pressed = press[node] + part * (press[node + 1] - press[node])
    states[:] = 0.0
    gain, steep, _ = _slowed(held, slowing, 0, pulled, 0.0)
    states[0, GAIN], states[0, GAIN_D], states[0, STEEP] = gain + pulled, pulled, steep
    states[0, FRICTION], states[0, NOW] = pulled / pressed, start
    for j in range(len(by_held)):
        states[j + 1, GAIN], _, _ = _slowed(by_held[j], by_slowing[j], 0, pulled, 0.0)
    return node


@compiled
def _stand(time: Any, size: int, start: float, ways: Any, bends: Any) -> int:
    """Writes a path that stands still up to the release; returns the first frame after it."""
    frame = 0
    while frame < size - 1 and time[frame] <= start:
        ways[:, frame] = 0.0
        bends[:, frame] = 0.0
        frame += 1
    return frame


@compiled
def _step(pull: float, press: float, node: int, after: float, law: Any, nodes: Any, states: Any, steps: Any) -> None:
    """Takes one step to a grid point, at the time `after`, s, with all blocks that have been released.

    A name with _d is the derivative by D, one with _j that by another number, and one with _dj that of both.
    """
    held, slowing, by_held, by_slowing = law
    for m in range(len(nodes)):
        if nodes[m] >= node:
            continue
        now, friction = states[m, 0, NOW], states[m, 0, FRICTION]
        speed, gain, steep = states[m, 0, SPEED], states[m, 0, GAIN], states[m, 0, STEEP]
        speed_d, gain_d = states[m, 0, SPEED_D], states[m, 0, GAIN_D]
        span = after - now
        guess = max(speed + span * gain, 0.0)
        at = min(int(np.sqrt(guess) / ROOT), COUNT - 2)
        rest = guess - (ROOT * at) ** 2
        holds = press * friction
        then, steep_then, bend_then = _slowed(held, slowing, at, holds, rest)
        then += pull
        faster = speed + 0.5 * span * (gain + then)
        guess_d = speed_d + span * (gain_d + steep * speed_d)
        faster_d = speed_d + 0.5 * span * (gain_d + steep * speed_d + holds + steep_then * guess_d)
        if faster <= 0.0:
            faster = faster_d = 0.0
        _go(states, steps, m, 0, span, faster, faster_d)
        states[m, 0, GAIN], states[m, 0, GAIN_D] = then + steep_then * (faster - guess), holds
        states[m, 0, STEEP], states[m, 0, NOW], steps[m, 0, SINCE], steps[m, 0, SPAN] = steep_then, after, now, span
        on, moves = guess > 0.0, faster > 0.0
        for j in range(len(by_held)):
            speed_j, gain_j = states[m, j + 1, SPEED], states[m, j + 1, GAIN]
            speed_dj, gain_dj = states[m, j + 1, SPEED_D], states[m, j + 1, GAIN_D]
            guess_j = (speed_j + span * gain_j) * on
            force_j, steep_j, _ = _slowed(by_held[j], by_slowing[j], at, holds, rest)
            steep_j += bend_then * guess_j
            faster_j = (speed_j + 0.5 * span * (gain_j + steep_then * guess_j + force_j)) * moves
            guess_dj = speed_dj + span * gain_dj
            then_dj = steep_then * guess_dj + steep_j * guess_d
            faster_dj = (speed_dj + 0.5 * span * (gain_dj + then_dj)) * moves
            _go(states, steps, m, j + 1, span, faster_j, faster_dj)
            states[m, j + 1, GAIN] = steep_then * faster_j + force_j + steep_j * (faster - guess)
            states[m, j + 1, GAIN_D] = steep_then * faster_dj + steep_j * faster_d


@compiled
def _go(states: Any, steps: Any, m: int, j: int, span: float, faster: float, faster_d: float) -> None:
    """Writes a step that ends with the speed `faster`, m/s, and its slope by D, and takes it."""
    speed, way, speed_d, way_d = states[m, j, SPEED], states[m, j, WAY], states[m, j, SPEED_D], states[m, j, WAY_D]
    steps[m, j, FROM], steps[m, j, AT], steps[m, j, RISE] = way, speed, faster - speed
    steps[m, j, FROM_D], steps[m, j, AT_D], steps[m, j, RISE_D] = way_d, speed_d, faster_d - speed_d
    states[m, j, WAY] = way + 0.5 * span * (speed + faster)
    states[m, j, WAY_D] = way_d + 0.5 * span * (speed_d + faster_d)
    states[m, j, SPEED], states[m, j, SPEED_D] = faster, faster_d


@compiled
def _look(time: float, steps: Any, m: int, ways: Any, bends: Any, frame: int) -> None:
    """Writes the last step's place, and the slopes of it, at a frame's time, s."""
    since = time - steps[m, 0, SINCE]
    part = 0.5 * since / steps[m, 0, SPAN]
    for j in range(steps.shape[1]):
        ways[m, j, frame] = steps[m, j, FROM] + since * (steps[m, j, AT] + part * steps[m, j, RISE])
        bends[m, j, frame] = steps[m, j, FROM_D] + since * (steps[m, j, AT_D] + part * steps[m, j, RISE_D])


@compiled
def _slowed(held: Any, slowing: Any, at: int, holds: float, rest: float) -> tuple[float, float, float]:
    """Gives the acceleration (m/s²) by friction and drag in one interval of the tables, its slope and its curvature."""
    c0, c1 = holds * held[at, 0] + slowing[at, 0], holds * held[at, 1] + slowing[at, 1]
    c2, c3 = holds * held[at, 2] + slowing[at, 2], holds * held[at, 3] + slowing[at, 3]
    steep = c1 + rest * (2.0 * c2 + 3.0 * rest * c3)
    return -(c0 + rest * (c1 + rest * (c2 + rest * c3))), -steep, -(2.0 * c2 + 6.0 * rest * c3)
