"""Lists the effects of the catalogue: what each does, its law, its parameters with their units and typical sizes.

With ids it says of each its source and bounds, too, what it is confounded with and what separates it. An effect of
your own is one more file in a folder that your rig file names under [physics].
"""

from __future__ import annotations

import argparse
import json
from itertools import groupby
from pathlib import Path
from textwrap import wrap
from typing import Any

from rich.console import Console

from shared import config
from shared.errors import UserError
from shared.rig import load_rig
from station.app.planting import effects_meant
from station.physics.catalogue import Catalogue, catalogue_of_table
from station.physics.effect import Effect
from station.physics.parameter import Parameter

NAME = "effects"
HELP = "list the effects that a diagnosis knows: laws, parameters, typical sizes"
EXAMPLE = "station effects kinetic_drop"
WIDTH = 100
"""Columns of the list."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("ids", nargs="*", metavar="ID", help="effects to explain; without any, all are listed")
    parser.add_argument("--rig", type=Path, help="rig file with effects of your own")
    parser.add_argument("--json", action="store_true", help="print them as JSON")


def run(options: argparse.Namespace) -> int:
    """Lists or explains; 0."""
    known = catalogue_of_table(load_rig(options.rig).physics if options.rig else config.Table({}))
    effects = [_named(name, known) for name in options.ids] or list(known.values())
    console = Console(highlight=False, soft_wrap=True)
    if options.json:
        print(json.dumps([_described(effect) for effect in effects], indent=1))
    elif options.ids:
        for effect in effects:
            console.print(_explained(effect), markup=False)
    else:
        console.print(_listed(effects), markup=False)
        console.print("Explain one:  station effects ID    Plant one:  station demo --effect ID=VALUE", markup=False)
    return 0


def _named(name: str, known: Catalogue) -> Effect:
    if name not in known:
        raise UserError(f"Expected an effect's id, got '{name}'{effects_meant(name, known)}")
    return known[name]


def _listed(effects: list[Effect]) -> str:
    """Returns one paragraph for each effect: its name and place, and below them its law and its parameters."""
    ordered = sorted(effects, key=lambda one: (one.layer, one.id))
    width = max(len(effect.id) for effect in ordered)
    lines = ["effect: what it is (what it acts in), with its law, and its parameters with their typical sizes"]
    lines += ["In the laws N is the normal load, v the speed, m the mass, g gravity, t and s times in seconds."]
    for effect in ordered:
        lines += ["", f"{effect.id:<{width}}  {effect.title} ({effect.layer})"]
        lines += _indented(f"law: {' '.join(effect.law.split())}")
        lines += _indented(f"typical: {', '.join(map(_sized, effect.parameters))}")
    return "\n".join([*lines, ""])


def _indented(text: str) -> list[str]:
    return wrap(text, WIDTH, initial_indent="  ", subsequent_indent="    ", break_on_hyphens=False)


def _sized(parameter: Parameter) -> str:
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    name = _with_symbol(parameter)
    return f"{name} (shape)" if parameter.is_shape else f"{name} {parameter.typical:g}{unit}"


def _with_symbol(parameter: Parameter) -> str:
    """Returns a parameter's symbol in its law before its name, where it has one: `d = drop`."""
    return f"{parameter.symbol} = {parameter.name}" if parameter.symbol else parameter.name


def _explained(effect: Effect) -> str:
    lines = [f"{effect.id}: {effect.title}", f"  law: {effect.law}", f"  source: {effect.source}"]
    # Parameters in a row that differ in their names alone, such as the waves of a map, are one line.
    for bounds, alike in groupby(effect.parameters, key=_bounds):
        lines += _indented(f"{', '.join(map(_with_symbol, alike))}{bounds}")
    if effect.confounded_with:
        lines.append(f"  confounded with: {', '.join(effect.confounded_with)}")
    return "\n".join([*lines, f"  separated by: {effect.separated_by}"])


def _bounds(one: Parameter) -> str:
    null = "a shape" if one.is_shape else f"null {one.null:g}, typical {one.typical:g}"
    return f"{one.in_unit}: {one.low:g} … {one.high:g}, {null}"


def _described(effect: Effect) -> dict[str, Any]:
    fields = ("id", "title", "law", "source", "layer", "family", "separated_by")
    parameters = [
        {name: getattr(one, name) for name in ("name", "symbol", "unit", "low", "high", "typical", "null")}
        for one in effect.parameters
    ]
    confounded = list(effect.confounded_with)
    return {name: getattr(effect, name) for name in fields} | {"parameters": parameters, "confounded_with": confounded}
