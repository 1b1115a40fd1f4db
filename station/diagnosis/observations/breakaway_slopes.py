# ruff: noqa: PLR0917 (compiled functions take no keyword-only arguments)
"""The compiled slopes of `breakaway_marginal`'s log likelihoods by the numbers of a law.

Let y (n,) be a path's residuals over the noise, a the creep's column and b the random effect's, all without their
means, and C = 1 + a a' + b b'. With z = C⁻¹ y, α = a'z and β = b'z (the expected creep and random effect),

    ln L = -½ y' C⁻¹ y - ½ ln |C|
    d ln L = -z' dy + (α z - C⁻¹ a)' da + (β z - C⁻¹ b)' db

by d C⁻¹ = -C⁻¹ dC C⁻¹ and d ln |C| = tr C⁻¹ dC; the expected information is dy' C⁻¹ dy + ½ tr (C⁻¹ dC)² (Mardia &
Marshall 1984, Biometrika 71, 135, eq. 2 and 3; db by the law is left out of the second term). The path's own slopes dy
and db are those of `breakaway_kernel`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from station.compiled import compiled
from station.diagnosis.observations.breakaway_kernel import room, shoot
from station.diagnosis.observations.breakaway_marginal import columns, marginal
from station.diagnosis.observations.breakaway_tables import Along
from station.physics.contact import Array

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
    """Returns the log likelihood of each moment `tried` (r, k), s, with its slopes by the law's numbers."""
    size = len(along.held) + 2
    found = Sloped(np.empty(tried.shape), np.zeros((*tried.shape, size)), np.zeros((*tried.shape, size, size)))
    _fill(tried, rows, laws, along, found)
    # A moment whose slopes overflow, or whose squares would, has none: it is as unlikely by any law nearby.
    known = (np.abs(found.slope) < LARGEST).all(axis=2) & (np.abs(found.information) < LARGEST**2).all(axis=(2, 3))
    found.slope[~known], found.information[~known] = 0.0, 0.0
    return found


@compiled
def _fill(tried: Any, rows: Any, laws: Any, along: Any, found: Any) -> None:
    width = rows.time_s.shape[1]
    crept, shot = np.zeros(width), room(tried.shape[1], len(along.held), width)
    for run in range(tried.shape[0]):
        size, sigma = rows.count[run], rows.sigma_m[run]
        weights = 1.0 / sigma, laws.spread / sigma
        shoot(rows, run, tried[run], laws, along, shot)
        for m in range(tried.shape[1]):
            ways, bends = shot.ways[m], shot.bends[m]
            columns(rows, run, shot.begin[m], laws, ways[0], bends[0], crept)
            found.log[run, m] = marginal(ways[0], crept, bends[0], size) - size * np.log(sigma)
            _score(crept, size, ways, bends, weights, found.slope[run, m], found.information[run, m])


@compiled
def _score(
    crept: Any, size: int, ways: Any, bends: Any, weights: tuple[float, float], slope: Any, information: Any
) -> None:
    """Writes one path's slopes and information; see the module. The columns are centred in place."""
    value, bent, ways, bends = ways[0], bends[0], ways[1:], bends[1:]
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
