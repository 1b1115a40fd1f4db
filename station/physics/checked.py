"""Checks of values that are read from a table; an unexpected one raises an error of one sentence."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from shared.errors import UserError


def only(table: Mapping[str, Any], allowed: set[str], where: str) -> None:
    """Refuses keys that are not `allowed`; raises `UserError`."""
    unknown = sorted(set(table) - allowed)
    if unknown:
        raise UserError(f"Expected only {', '.join(sorted(allowed))} in {where}, got {', '.join(unknown)}")


def number(value: object, name: str, valid: Callable[[float], bool], expected: str) -> float:
    """The value as a float, if it is a number that `valid` accepts; raises `UserError` otherwise."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not valid(float(value)):
        raise UserError(f"Expected {expected} for {name}, got {value!r}")
    return float(value)


def numbers(values: object, name: str) -> list[float]:
    """The values as floats; raises `UserError` unless they are a list of finite numbers."""
    if not isinstance(values, list):
        raise UserError(f"Expected a list of numbers for {name}, got {values!r}")
    return [number(value, name, math.isfinite, "finite numbers") for value in values]  # pyright: ignore[reportUnknownVariableType]: what a parsed file holds
