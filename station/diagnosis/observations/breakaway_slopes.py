# ruff: noqa: PLR0917 (compiled functions take no keyword-only arguments)
"""The compiled slopes of `breakaway_kernel`'s log likelihoods by the numbers of a law.

Let y (n,) be a path's residuals over the noise, a the creep's column and b the random effect's, all without their
means, and C = 1 + a a' + b b'. With z = C⁻¹ y, α = a'z and β = b'z (the expected creep and random effect),

    ln L = -½ y' C⁻¹ y - ½ ln |C|
    d ln L = -z' dy + (α z - C⁻¹ a)' da + (β z - C⁻¹ b)' db

by d C⁻¹ = -C⁻¹ dC C⁻¹ and d ln |C| = tr C⁻¹ dC; the expected information is dy' C⁻¹ dy + ½ tr (C⁻¹ dC)² (Mardia &
Marshall 1984, Biometrika 71, 135, eq. 2 and 3; db by the law is left out of the second term). The path's own slopes dy
and db follow the differentiated steps of its integration (the variational equation; Hairer, Nørsett & Wanner 1993,
I.14), which are linear.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from station.diagnosis.compiled import compiled
from station.diagnosis.observations.breakaway_kernel import (
    AT,
    BEND,
    FASTER_D,
    GUESS_D,
    HOLDS,
    LAG,
    MOVES,
    ON,
    PARTS,
    REST,
    ROOT,
    SPAN,
    STEEP,
    STEP_S,
    columns,
    marginal,
    shoot,
    slowed,
)
from station.physics.contact import Array


class Along(NamedTuple):
    """The slopes (q, g, COUNT - 1, 4) of the cubics of `Laws` by q numbers."""

    held: Array
    slowing_m_s2: Array


LARGEST = 1e12
"""No slope of a log likelihood that a fit could follow is larger."""


class Sloped(NamedTuple):
    """Log likelihoods (r, k), their slopes (r, k, q + 2) and the expected information (r, k, q + 2, q + 2).

    The last two numbers are ln spread and ln creep.
    """

    log: Array
    slope: Array
    information: Array


def sloped(tried: Array, rows: Any, laws: Any, along: Along) -> Sloped:
    """The log likelihood of each moment `tried` (r, k), s, with its slopes by the law's numbers."""
    size = len(along.held) + 2
    found = Sloped(np.empty(tried.shape), np.zeros((*tried.shape, size)), np.zeros((*tried.shape, size, size)))
    _fill(tried, rows, laws, along, found)
    # A moment whose slopes overflow, or whose squares would, has none: it is as unlikely by any law nearby.
    known = (np.abs(found.slope) < LARGEST).all(axis=2) & (np.abs(found.information) < LARGEST**2).all(axis=(2, 3))
    found.slope[~known], found.information[~known] = 0.0, 0.0
    return found


@compiled
def _fill(tried: Any, rows: Any, laws: Any, along: Any, found: Any) -> None:
    width, many = rows.time_s.shape[1], len(along.held)
    shot, crept = np.zeros((2, width)), np.zeros(width)
    steps = np.empty((rows.pull.shape[1] + 2, PARTS))
    ways, bends = np.empty((many, width)), np.empty((many, width))
    for run in range(tried.shape[0]):
        size, sigma = rows.count[run], rows.sigma_m[run]
        for m in range(tried.shape[1]):
            begin = shoot(rows, run, tried[run, m], laws, shot, steps)
            columns(rows, run, begin, laws, shot, crept)
            for j in range(many):
                _sway(rows, run, tried[run, m], along.held[j, laws.of_run[run]],
                      along.slowing_m_s2[j, laws.of_run[run]], steps, ways[j], bends[j])  # fmt: skip
            found.log[run, m] = marginal(shot[0], crept, shot[1], size) - size * np.log(sigma)
            weights = 1.0 / sigma, laws.spread / sigma
            _score(shot, crept, size, ways, bends, weights, found.slope[run, m], found.information[run, m])


@compiled
def _sway(rows: Any, run: int, start: float, held: Any, slowing: Any, steps: Any, way: Any, bend: Any) -> None:
    """Writes the slopes of a path, and of its slope by D, by a number whose tables' slopes are given.

    It differentiates the steps of `shoot` one by one: a lower-case name with _j is the derivative by the number, with
    _dj that of the derivative by D.
    """
    time, size = rows.time_s[run], rows.count[run]
    node, now = int((start - rows.first_s[run]) / STEP_S), start
    gain_j, _, _ = slowed(held[0], slowing[0], steps[node, HOLDS], 0.0, ROOT * ROOT)
    speed_j = way_j = speed_dj = way_dj = gain_dj = 0.0
    k = 0
    while k < size - 1 and time[k] <= start:
        way[k] = bend[k] = 0.0
        k += 1
    while k < size:
        node += 1
        step = steps[node]
        span, steep, at = step[SPAN], step[STEEP], int(step[AT])
        after = rows.first_s[run] + node * STEP_S
        guess_j = (speed_j + span * gain_j) * step[ON]
        force_j, steep_j, _ = slowed(held[at], slowing[at], step[HOLDS], step[REST], ROOT * ROOT * (2 * at + 1))
        steep_j += step[BEND] * guess_j
        faster_j = (speed_j + 0.5 * span * (gain_j + steep * guess_j + force_j)) * step[MOVES]
        guess_dj = speed_dj + span * gain_dj
        then_dj = steep * guess_dj + steep_j * step[GUESS_D]
        faster_dj = (speed_dj + 0.5 * span * (gain_dj + then_dj)) * step[MOVES]
        while k < size and time[k] <= after:
            since = time[k] - now
            part = 0.5 * since / span
            way[k] = way_j + since * (speed_j + part * (faster_j - speed_j))
            bend[k] = way_dj + since * (speed_dj + part * (faster_dj - speed_dj))
            k += 1
        way_j += 0.5 * span * (speed_j + faster_j)
        way_dj += 0.5 * span * (speed_dj + faster_dj)
        gain_j = steep * faster_j + force_j + steep_j * step[LAG]
        gain_dj = steep * faster_dj + steep_j * step[FASTER_D]
        speed_j, speed_dj, now = faster_j, faster_dj, after


@compiled
def _score(
    shot: Any, crept: Any, size: int, ways: Any, bends: Any, weights: tuple[float, float], slope: Any, information: Any
) -> None:
    """Writes one path's slopes and information; see the module. The columns are centred in place."""
    value, bent = shot
    value -= value[:size].mean()
    crept -= crept[:size].mean()
    bent -= bent[:size].mean()
    of_one, of_two, one_two = 1.0, 1.0, 0.0
    at_one = at_two = 0.0
    for i in range(size):
        of_one += crept[i] * crept[i]
        of_two += bent[i] * bent[i]
        one_two += crept[i] * bent[i]
        at_one += crept[i] * value[i]
        at_two += bent[i] * value[i]
    volume = of_one * of_two - one_two * one_two
    # The covariance of creep and random effect, given the path.
    v_one, v_two, v_both = of_two / volume, of_one / volume, -one_two / volume
    creep, effect = v_one * at_one + v_both * at_two, v_both * at_one + v_two * at_two
    many = len(ways)
    for j in range(many):
        mean = 0.0
        for i in range(size):
            left = value[i] - crept[i] * creep - bent[i] * effect
            by_bend = effect * left - v_both * crept[i] - v_two * bent[i]
            slope[j] += weights[0] * left * ways[j, i] + weights[1] * by_bend * bends[j, i]
            mean += ways[j, i] / size
        on_one = on_two = 0.0
        for i in range(size):
            ways[j, i] = weights[0] * (ways[j, i] - mean)
            on_one += ways[j, i] * crept[i]
            on_two += ways[j, i] * bent[i]
        bends[j, 0], bends[j, 1] = on_one, on_two
        for other in range(j + 1):
            both = 0.0
            for i in range(size):
                both += ways[j, i] * ways[other, i]
            both -= on_one * (v_one * bends[other, 0] + v_both * bends[other, 1])
            both -= on_two * (v_both * bends[other, 0] + v_two * bends[other, 1])
            information[j, other] = information[other, j] = both
    slope[many], slope[many + 1] = effect**2 - 1.0 + v_two, creep**2 - 1.0 + v_one
    information[many, many], information[many + 1, many + 1] = 2.0 * (1.0 - v_two) ** 2, 2.0 * (1.0 - v_one) ** 2
    information[many, many + 1] = information[many + 1, many] = 2.0 * v_both**2
