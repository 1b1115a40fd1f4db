"""Reads pairs from JSON: limit_curves.json of `station analyze`, and friction_pairs.json of `station export`."""

from __future__ import annotations

import json
import math
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Any

from shared.errors import UserError
from station.export.from_fit import pair_of_fit
from station.export.measured import MeasuredPair
from station.friction.limit_curve.curve import LimitCurveFit

PAIRS_FORMAT = "friction pairs"
"""The words of friction_pairs.json about itself."""


@dataclass(frozen=True, slots=True)
class Read:
    """The pairs of a file, and sentences about those for which the analysis found no curve."""

    pairs: tuple[MeasuredPair, ...]
    refused: tuple[str, ...] = ()


def read_pairs(path: Path) -> Read:
    """Reads the pairs in the file.

    Raises:
        UserError: if it cannot be read or is neither kind.
    """
    try:
        table: Any = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(table, dict):
            raise ValueError("it holds no table")
        rows = table["pairs"]
        if table.get("format") == PAIRS_FORMAT:
            return Read(tuple(_measured(row) for row in rows))
        return Read(
            tuple(_fitted(row) for row in rows if row["fit"] is not None),
            tuple(_without_fit(row) for row in rows if row["fit"] is None),
        )
    except OSError as error:
        raise UserError(f"Expected limit curves at {path}, but it cannot be read: {error.strerror}") from error
    except KeyError as error:
        raise UserError(f"{_expected(path)} ({error} is missing)") from error
    except (ValueError, TypeError, AttributeError, LookupError, ArithmeticError, RecursionError) as error:
        raise UserError(f"{_expected(path)} ({error})") from error


def _expected(path: Path) -> str:
    return (
        f"Expected limit_curves.json of `station analyze` or friction_pairs.json of this command, but {path} is neither"
    )


def _fitted(row: Any) -> MeasuredPair:
    return pair_of_fit(LimitCurveFit.from_dict(row["fit"]), object=str(row["object"]), plate=str(row["plate"]))


def _without_fit(row: Any) -> str:
    return (
        f"{row['object']} on {row['plate']}: {row['no_fit']} Export its recording in place of this file for the mean."
    )


def _measured(row: Any) -> MeasuredPair:
    """Reads a pair; null stands for NaN, and fields left out keep their defaults, for tables written by hand."""
    values: dict[str, Any] = {}
    for spec in fields(MeasuredPair):
        if spec.name in row or spec.default is MISSING:
            values[spec.name] = _value(row[spec.name])
    pair = MeasuredPair(**values)
    if pair.fixed_in not in ("object", "plate"):
        raise ValueError(f"fixed_in of {pair.name} is {pair.fixed_in!r}, not 'object' or 'plate'")
    return pair


def _value(value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_value(each) for each in value)
    return math.nan if value is None else value
