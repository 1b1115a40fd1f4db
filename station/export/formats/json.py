"""Plain JSON: every number of the measurement, and materials for engines that combine two of them."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from station.export.exported import ExportedFile, NamedPair
from station.export.materials import RULES, each_material, shared_materials
from station.export.measured import MeasuredPair
from station.export.reading import PAIRS_FORMAT

NAME = "json"
HELP = "plain JSON: all numbers, and the materials for each rule by which engines combine two"
_UNITS = "coefficients without unit; axis_rad and one_way_rad in rad from x of fixed_in; side_m in m, mass_kg in kg"


def export(pairs: Sequence[NamedPair]) -> tuple[ExportedFile, ...]:
    """Returns one file for all pairs."""
    measured = [each.pair for each in pairs]
    table = {
        "format": PAIRS_FORMAT,
        "version": 1,
        "units": _UNITS,
        "pairs": [{"name": each.stem, **_plain(each.pair)} for each in pairs],
        "materials_for_all_pairs": [_shared(measured, index) for index in range(len(RULES))],
    }
    return (ExportedFile("friction_pairs.json", json.dumps(table, indent=2, ensure_ascii=False) + "\n"),)


def _plain(pair: MeasuredPair) -> dict[str, Any]:
    values = {key: _null(value) for key, value in asdict(pair).items()}
    return {**values, "mu": pair.mu, "each_material": {rule: each_material(rule, pair.mu) for rule in RULES}}


def _null(value: Any) -> Any:
    """Replaces NaN, which JSON does not have, with None."""
    if isinstance(value, tuple):
        return [_null(each) for each in value]
    return None if isinstance(value, float) and math.isnan(value) else value


def _shared(pairs: Sequence[MeasuredPair], index: int) -> dict[str, Any]:
    shared = shared_materials(RULES[index], pairs)
    return {
        "rule": shared.rule,
        "mu": dict(shared.mu),
        "misread_deg": math.degrees(shared.misread_rad),
        "misread_pair": shared.worst,
    }
