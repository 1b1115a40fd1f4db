"""The best known linear combination of numbers that trade off."""

from __future__ import annotations

import numpy as np

from station.diagnosis.result import Combination, rounded
from station.physics.contact import Array
from station.physics.effect import Values
from station.physics.parameter import Parameter

INFLATED = 3.0
"""A number says little alone if its standard error is more than this times that with the other numbers given.

Three is a correlation of .94 between two numbers. `station diagnose --json` of a case with it at 1 or 10 shows which
combinations come and go; no claim depends on it.
"""


def inflation(covariance: Array) -> Array:
    """Returns each number's standard error (k,) over that with the others given; `covariance` is (k, k)."""
    return np.sqrt(np.diag(covariance) * np.diag(np.linalg.pinv(covariance, hermitian=True)))


def best_known_line(
    free: tuple[Parameter, ...], covariance: Array, values: Values, at_bound: list[bool]
) -> tuple[Combination, ...]:
    """Returns the best known linear combination of the numbers that trade off; empty if none do.

    `covariance` (k, k) is that of the free numbers, in their units. A number at its bound is known to lie there, and a
    number that stands for itself has no part in it.
    """
    inside = np.flatnonzero(~np.array(at_bound))
    inside = inside[inflation(covariance[np.ix_(inside, inside)]) > INFLATED]
    if len(inside) < 2:
        return ()
    own = covariance[np.ix_(inside, inside)]
    numbers = [free[index] for index in inside.tolist()]
    factors, order = _best_known(own, np.array([one.typical for one in numbers]))
    words = "".join(_words(float(factors[index]), numbers[index].name) for index in order)
    return (
        Combination(
            expression=words.removeprefix(" + "),
            value=float(sum(factor * values[one.name] for factor, one in zip(factors, numbers, strict=True))),
            sd=float(np.sqrt(factors @ own @ factors)),
            unit=numbers[order[0]].unit,
        ),
    )


def _best_known(covariance: Array, typical: Array) -> tuple[Array, list[int]]:
    """Returns the factors (k,) of the combination with the smallest variance in `typical` sizes (k,), and their order.

    The largest comes first, and is 1. `covariance` is (k, k).
    """
    _, axes = np.linalg.eigh(covariance / np.outer(typical, typical))
    first = int(np.argmax(np.abs(axes[:, 0])))
    factors = axes[:, 0] / typical
    return factors / factors[first], [first, *(index for index in range(len(typical)) if index != first)]


def _words(factor: float, name: str) -> str:
    """Returns a term of a sum in words, with its sign before it."""
    size = "" if factor == 1.0 else f"{rounded(abs(factor), 3)} "
    return f" {'-' if factor < 0 else '+'} {size}{name}"
