"""The generator's parametrisation of an effect is mapped to the tool's, where the map is exact."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from shared.rig import RigConfig
from tests.proof.key import Truth
from tests.proof.said import Said, number

Values = Mapping[str, float]


def as_told(_told: Values, _truth: Truth, _rig: RigConfig) -> float:
    return 1.0


@dataclass(frozen=True)
class Map:
    """The names and scales of an effect's parameters in the tool; None where this case has no exact map.

    `scale`: what the tool's values are times before they are compared, by all of its values of the effect.
    """

    to_tool: Callable[[Values, Truth, RigConfig], Values | None]
    why: str
    scale: Callable[[Values, Truth, RigConfig], float] = as_told


@dataclass(frozen=True, kw_only=True)
class Pull:
    """One parameter: how far off it is in its standard errors, and whether the 90 % interval holds the truth."""

    case: str
    effect: str
    name: str
    z: float
    covered: bool


def pulls_of(
    truth: Truth, said: Said, rig: RigConfig, *, maps: Mapping[str, Map], inexact: Mapping[str, str]
) -> tuple[list[Pull], dict[str, str]]:
    """Returns the pulls of every rightly named effect of a case, and the reasons why others are left out."""
    listed, left = list[Pull](), dict[str, str]()
    claimed = {effect["id"]: effect for effect in said.claimed}
    for effect in truth.effects:
        if effect.id not in claimed:
            continue
        exact = maps.get(effect.id)
        true = exact.to_tool(effect.parameters, truth, rig) if exact else None
        if exact is None or true is None:
            left[effect.id] = exact.why if exact else inexact.get(effect.id, "another law")
            continue
        parameters = claimed[effect.id]["parameters"]
        values = {name: number(told["value"]) for name, told in parameters.items()}
        scale = exact.scale(values, truth, rig)
        for name, value in true.items():
            told = parameters.get(name)
            sd = scale * number(told["sd"]) if told else math.nan
            if told is None or not sd > 0:
                left[f"{effect.id}.{name}"] = "the tool gives no standard error (at a bound, or not free)"
                continue
            z = (scale * number(told["value"]) - value) / sd
            low, high = (scale * number(end) for end in told["interval90"])
            listed.append(Pull(case=truth.id, effect=effect.id, name=name, z=z, covered=low <= value <= high))
    return listed, left
