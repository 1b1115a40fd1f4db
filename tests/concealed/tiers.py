"""What each tier conceals."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from typing import Any

from numpy.random import Generator

from tests.concealed.cases import (
    STRENGTHS,
    Plan,
    Strong,
    at_strength,
    case_id,
    entry_of,
    generator,
    origin_of,
)
from tests.concealed.catalogue import BEYOND, EFFECTS, Effect
from tests.concealed.design import Setting
from tests.concealed.protocols import draw_setting
from tests.concealed.session import run_session

Drawn = tuple[Setting, list[Strong], dict[str, Any]]
"""A setting, what is concealed in it, and what else the key says."""
Draw = Callable[[Generator, int, Collection[str]], Drawn]


def _null(rng: Generator, _index: int, _only: Collection[str]) -> Drawn:
    return draw_setting(rng), [], {"answer": "none"}


def _null_nuisance(rng: Generator, _index: int, _only: Collection[str]) -> Drawn:
    return draw_setting(rng, harsh=True), [], {"answer": "none"}


def _chosen(effects: dict[str, Effect], index: int, only: Collection[str]) -> tuple[Effect, int]:
    """Each effect in turn; and how often it has had its turn."""
    left = [effect for name, effect in effects.items() if not only or name in only]
    return left[index % len(left)], index // len(left)


def _single(rng: Generator, index: int, only: Collection[str]) -> Drawn:
    left = max(1, sum(not only or name in only for name in EFFECTS))
    effect, turn = _chosen(EFFECTS, index, only)
    strength = STRENGTHS[(index % left + turn) % len(STRENGTHS)]
    setting, strong = at_strength(rng, [effect], [strength])
    return setting, strong, {"answer": "effects"}


def _outside(rng: Generator, index: int, only: Collection[str]) -> Drawn:
    effect, turn = _chosen(BEYOND, index, only)
    setting, strong = at_strength(rng, [effect], [(4.0, 2.0)[turn % 2]])
    return setting, strong, {"answer": "other"}


_DRAWS: dict[str, Draw] = {
    "null": _null,
    "null_nuisance": _null_nuisance,
    "single": _single,
    "outside": _outside,
}


def plan_case(tier: str, index: int, *, seed: int, only: Collection[str] = ()) -> Plan:
    """The plan of a tier's case number `index`; the same arguments give the same plan.

    Raises:
        ValueError: if nothing of the tier is called as `only` says.
    """
    origin = origin_of(tier, index, seed)
    rng = generator(origin, "design")
    setting, strong, more = _DRAWS[tier](rng, index, only)
    session = run_session(setting, generator(origin, "session"))
    return Plan(
        id=case_id(origin),
        setting=setting,
        mu_guess=setting.world.mu * math.exp(float(rng.normal(0.0, 0.08))),
        entry=entry_of(tier, setting, strong, session) | more,
        origin=origin,
    )
