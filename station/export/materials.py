"""Combines two materials' coefficients as engines do, and finds materials from which they read a measured pair back.

| rule | of a and b | engines |
|---|---|---|
| max | the larger | MuJoCo (geoms without a pair) |
| min | the smaller | ODE and DART (Gazebo) |
| average | (a + b) / 2 | PhysX, USD physics |
| harmonic | 2 a b / (a + b) | Drake |
| product | a b | Bullet |
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from station.export.measured import Array, MeasuredPair

Rule = Literal["max", "min", "average", "harmonic", "product"]
_LEAST_MU = 1e-3


def combine(rule: Rule, a: float, b: float) -> float:
    """Returns the coefficient that an engine makes of two materials'."""
    match rule:
        case "max":
            return max(a, b)
        case "min":
            return min(a, b)
        case "average":
            return (a + b) / 2
        case "harmonic":
            return 2 * a * b / (a + b) if a + b > 0 else 0.0
        case "product":
            return a * b


RULES: tuple[Rule, ...] = ("max", "min", "average", "harmonic", "product")


def each_material(rule: Rule, mu: float) -> float:
    """Returns the coefficient that both materials of a pair get, so that the engine reads `mu` back."""
    return math.sqrt(mu) if rule == "product" else mu


@dataclass(frozen=True, slots=True)
class SharedMaterials:
    """One coefficient a material for all pairs at once, and how far the engine's reading is off at worst.

    `misread_rad` is in the angle of repose, for the pair named `worst`.
    """

    rule: Rule
    mu: Mapping[str, float]
    misread_rad: float
    worst: str


def shared_materials(rule: Rule, pairs: Sequence[MeasuredPair]) -> SharedMaterials:
    """Returns one coefficient a material, for scenes that hold several pairs: exact where the rule allows it.

    Average, harmonic and product are linear in the materials, in their reciprocals and in their logarithms: least
    squares there. Under max a material gets the least of its pairs' coefficients (no pair is then read too high), under
    min the greatest (none is read too low).
    """
    names = sorted({name for pair in pairs for name in (pair.object, pair.plate)})
    mu = dict(zip(names, _solve(rule, names, pairs), strict=True))
    misread = {
        pair.name: abs(math.atan(combine(rule, mu[pair.object], mu[pair.plate])) - math.atan(pair.mu)) for pair in pairs
    }
    worst = max(misread, key=lambda name: misread[name])
    return SharedMaterials(rule, mu, misread[worst], worst)


def _solve(rule: Rule, names: Sequence[str], pairs: Sequence[MeasuredPair]) -> list[float]:
    match rule:
        case "max" | "min":
            choose = min if rule == "max" else max
            return [choose(pair.mu for pair in pairs if name in (pair.object, pair.plate)) for name in names]
        case "average":
            return _linear(names, pairs, into=lambda mu: 2 * mu, back=lambda x: x)
        case "harmonic":
            return _linear(names, pairs, into=lambda mu: 2 / mu, back=lambda x: 1 / np.maximum(x, _LEAST_MU))
        case "product":
            return _linear(names, pairs, into=_log, back=_exp)


def _log(mu: Array) -> Array:
    return np.log(mu)


def _exp(x: Array) -> Array:
    return np.exp(x)


def _linear(
    names: Sequence[str],
    pairs: Sequence[MeasuredPair],
    *,
    into: Callable[[Array], Array],
    back: Callable[[Array], Array],
) -> list[float]:
    """Solves into(mu of the pair) = x of its object + x of its plate for the materials' x."""
    columns = np.zeros((len(pairs), len(names)))
    for row, pair in enumerate(pairs):
        columns[row, names.index(pair.object)] += 1
        columns[row, names.index(pair.plate)] += 1
    wanted = into(np.array([pair.mu for pair in pairs]))
    solved = np.asarray(np.linalg.lstsq(columns, wanted)[0], dtype=np.float64)
    return [max(float(value), _LEAST_MU) for value in back(solved)]
