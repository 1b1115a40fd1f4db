"""Plain CSV: one row a pair."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from shared.csv_text import csv_lines
from station.export.exported import ExportedFile, NamedPair
from station.export.materials import RULES, each_material
from station.export.measured import MeasuredPair

NAME = "csv"
HELP = "plain CSV: one row a pair, with the coefficient of each material by the engines' rules"


def export(pairs: Sequence[NamedPair]) -> tuple[ExportedFile, ...]:
    """Returns one table for all pairs."""
    rows = [_row(each.pair) for each in pairs]
    text = "".join(csv_lines([tuple(rows[0]), *(tuple(row.values()) for row in rows)]))
    return (ExportedFile("friction_pairs.csv", text),)


def _row(pair: MeasuredPair) -> dict[str, Any]:
    low_1, high_1 = pair.mu_1_interval
    low_2, high_2 = pair.mu_2_interval
    numbers = {
        "mu": pair.mu, "mu_1": pair.mu_1, "mu_1_low": low_1, "mu_1_high": high_1,
        "mu_2": pair.mu_2, "mu_2_low": low_2, "mu_2_high": high_2,
        "axis_rad": pair.axis_rad, "one_way": pair.one_way, "one_way_rad": pair.one_way_rad,
        "other_ratio": pair.other_ratio, "misfit_rad": pair.misfit_rad, "kinetic_ratio": pair.kinetic_ratio,
        "scatter": pair.scatter, "side_m": pair.side_m, "mass_kg": pair.mass_kg,
        **{f"each_material_{rule}": each_material(rule, pair.mu) for rule in RULES},
    }  # fmt: skip
    plain = {key: "" if math.isnan(value) else repr(float(value)) for key, value in numbers.items()}
    return {"object": pair.object, "plate": pair.plate, "fixed_in": pair.fixed_in, "samples": pair.samples, **plain}
