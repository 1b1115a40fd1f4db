"""Checks of values that are read from a table; an unexpected one raises an error of one sentence."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from shared.arguments import nearest
from shared.errors import UserError


def a_table(value: object, where: str) -> Mapping[str, Any]:
    """Returns the value, if it is a table; raises `UserError` otherwise."""
    if not isinstance(value, Mapping):
        raise UserError(f"Expected a table for {where}, got {value!r}")
    return value  # pyright: ignore[reportUnknownVariableType]: what a parsed file holds


def only(table: Mapping[str, Any], allowed: set[str], where: str) -> None:
    """Refuses what is no table, and keys that are not `allowed`; raises `UserError`."""
    a_table(table, where)
    unknown = sorted(set(table) - allowed)
    if unknown:
        hint = nearest(unknown[0], allowed)
        raise UserError(f"Expected only {', '.join(sorted(allowed))} in {where}, got {', '.join(unknown)}{hint}")


def number(value: object, name: str, valid: Callable[[float], bool], expected: str) -> float:
    """Returns the value as a float, if it is a number that `valid` accepts; raises `UserError` otherwise."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not _holds(value, valid):
        raise UserError(f"Expected {expected} for {name}, got {value!r}")
    return float(value)


def _holds(value: float, valid: Callable[[float], bool]) -> bool:
    try:
        return valid(float(value))
    except OverflowError:  # a whole number that is larger than any float
        return False


def numbers(values: object, name: str) -> list[float]:
    """Returns the values as floats; raises `UserError` unless they are a list of finite numbers."""
    if not isinstance(values, list):
        raise UserError(f"Expected a list of numbers for {name}, got {values!r}")
    return [number(value, name, math.isfinite, "finite numbers") for value in values]  # pyright: ignore[reportUnknownVariableType]: what a parsed file holds
