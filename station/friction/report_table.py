"""Defines a table of the report."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ReportTable:
    """A table; the first column is text, the others are numbers. `note` stands below it."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


def number(value: float, form: str) -> str:
    """Returns a number, or a dash for none; a percentage has a space before its sign."""
    return "–" if math.isnan(value) else format(value, form).replace("%", " %")


def percent(share: float, digits: int = 1) -> str:
    """Returns a share in percent for a sentence."""
    return number(share, f".{digits}%")


def chance(p: float) -> str:
    """Returns a p-value for a table."""
    return "< 1e-99" if p < 1e-99 else number(p, ".2g")


def p_is(p: float) -> str:
    """Returns a p-value for a sentence."""
    return f"p {chance(p)}" if p < 1e-99 else f"p = {chance(p)}"
