"""Reads the values that a page sends with an action."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from typing import Any

from shared.errors import UserError

_LARGEST = sys.float_info.max
"""The largest number of a float: JSON has whole ones of any length."""


def text(asked: Mapping[str, Any], name: str) -> str:
    """Returns a text of that name.

    Raises:
        UserError: if it is missing or something else.
    """
    value = asked.get(name)
    if not isinstance(value, str):
        raise UserError(f"Expected a text as '{name}', got {value!r}")
    return value


def whole_number(asked: Mapping[str, Any], name: str) -> int:
    """Returns a whole number of that name.

    Raises:
        UserError: if it is missing or something else.
    """
    value = asked.get(name)
    if not isinstance(value, int) or isinstance(value, bool):
        raise UserError(f"Expected a whole number as '{name}', got {value!r}")
    return value


def number(asked: Mapping[str, Any], name: str) -> float:
    """Returns a finite number of that name.

    Raises:
        UserError: if it is missing or something else.
    """
    value = asked.get(name)
    if not isinstance(value, int | float) or isinstance(value, bool) or not -_LARGEST <= value <= _LARGEST:
        raise UserError(f"Expected a number as '{name}', got {value!r}")
    return float(value)


def flag(asked: Mapping[str, Any], name: str) -> bool:
    """Returns a yes or no of that name.

    Raises:
        UserError: if it is missing or something else.
    """
    value = asked.get(name)
    if not isinstance(value, bool):
        raise UserError(f"Expected true or false as '{name}', got {value!r}")
    return value


def unknown(name: str, known: Iterable[str]) -> UserError:
    """Returns the mistake of asking for an action that there is not."""
    return UserError(f"Expected one of {', '.join(known)}, got '{name}'")
