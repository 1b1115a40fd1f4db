"""Numbers of the page as text."""

from __future__ import annotations

import math
from html import escape

from station.diagnosis.result import Value


def number(value: float, digits: int = 2, *, sign: bool = False) -> str:
    """Returns a number with `digits` decimals; a dash if it is not finite."""
    if not math.isfinite(value):
        return "–"
    return minus(f"{value:+.{digits}f}" if sign else f"{value:.{digits}f}")


def minus(text: str) -> str:
    """Returns a number's text with a true minus sign, at which no line breaks."""
    return text.replace("-", "−")


def whole(text: str) -> str:
    """Returns plain text as a cell that stays on one line."""
    return f'<span class="whole">{escape(text)}</span>'


def p_value(p: float) -> str:
    """Returns a p-value; smaller ones than one in a million are not told apart."""
    return "≤ 1e-6" if p <= 1e-6 else f"{p:.2g}"


def p_equals(p: float) -> str:
    """Returns a p-value for a sentence: 'p = 0.03', 'p ≤ 1e-6'."""
    return f"p {p_value(p)}" if p <= 1e-6 else f"p = {p_value(p)}"


def with_error(value: Value) -> tuple[str, str, str]:
    """Returns value, 90 % interval and unit, to two digits of the standard error.

    Lengths are in mm, angles in degrees.
    """
    factor, unit = value.read_in[0], value.read_in[1].strip()
    sd = factor * value.sd
    if not math.isfinite(value.value):
        return "–", "–", unit
    if not math.isfinite(sd) or sd <= 0:
        return minus(f"{factor * value.value:.3g}"), "–", unit
    digits = min(max(0, 1 - math.floor(math.log10(sd))), 9)
    numbers = (number(factor * one, digits) for one in (value.value, *value.interval90))
    middle, low, high = numbers
    return middle, whole(f"{low} … {high}"), unit
