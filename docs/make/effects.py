"""The reference of effects: the law of each, its parameters, its source, and what tells it from others."""

from __future__ import annotations

import inspect
import sys
from itertools import groupby

from docs.make.fields import heading, rows
from station.physics.catalogue import catalogue, confused
from station.physics.effect import Effect
from station.physics.parameter import Parameter


def page() -> str:
    """The whole page."""
    known = catalogue()
    ordered = sorted(known.values(), key=lambda effect: (effect.layer, effect.id))
    parts = [
        heading(1, "Effects"),
        f"The {len(known)} effects that the diagnosis knows and the simulators have, written from "
        "`station/physics/effects`. An effect vanishes at its null value; a shape has no meaning while it does. Where "
        "two effects are confounded, the standard protocol cannot tell them apart.",
    ]
    for layer, effects in groupby(ordered, key=lambda effect: effect.layer):
        parts += [heading(2, f"Acts in: {layer}"), *(_effect(effect, confused(known, effect.id)) for effect in effects)]
    return "\n\n".join(parts) + "\n"


def _effect(effect: Effect, others: frozenset[str]) -> str:
    module = inspect.cleandoc(sys.modules[type(effect).__module__].__doc__ or "")
    told = [
        heading(3, effect.id),
        f"{effect.title[0].upper()}{effect.title[1:]}; family: {effect.family}.",
        module,
        f"Law: `{effect.law}`",
        rows(
            ("parameter", "in the law", "unit", "null", "from", "to", "typical"),
            [_parameter(one) for one in effect.parameters],
        ),
        f"Source: {effect.source}",
    ]
    if others:
        links = ", ".join(f"[{name}](#{name})" for name in sorted(others))
        told.append(f"Confounded with {links}; separated by {effect.separated_by}.")
    return "\n\n".join(told)


def _parameter(one: Parameter) -> tuple[str, ...]:
    null = "shape" if one.null is None else f"{one.null:g}"
    symbol = f"`{one.symbol}`" if one.symbol else ""
    return (
        f"`{one.name}`",
        symbol,
        one.unit,
        null,
        f"{one.low:g}",
        f"{one.high:g}",
        "" if one.is_shape else f"{one.typical:g}",
    )
