"""Defines what an exporter takes and gives, and the words that every format writes about a measurement."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from station.export.measured import MASS_KG, SIDE_M, MeasuredPair
from station.friction.slides import counted

_WIDTH = 110


@dataclass(frozen=True, slots=True)
class NamedPair:
    """A pair with the name that its files get: letters, digits and underscores, different for every pair."""

    stem: str
    pair: MeasuredPair


@dataclass(frozen=True, slots=True)
class ExportedFile:
    """A file's name and text, and sentences about what the measurement of `pair` says and this file cannot."""

    name: str
    text: str
    pair: str = ""
    unsupported: tuple[str, ...] = ()


def named(pairs: Sequence[MeasuredPair]) -> tuple[NamedPair, ...]:
    """Returns the pairs with their stems, such as steel_on_wood."""
    seen: dict[str, int] = {}
    result: list[NamedPair] = []
    for pair in pairs:
        stem = re.sub(r"\W+", "_", pair.name, flags=re.ASCII).strip("_").lower() or "pair"
        if stem[0].isdigit():
            stem = f"pair_{stem}"
        seen[stem] = seen.get(stem, 0) + 1
        result.append(NamedPair(stem if seen[stem] == 1 else f"{stem}_{seen[stem]}", pair))
    return tuple(result)


def unsupported_lines(unsupported: Iterable[str]) -> list[str]:
    """Returns the sentences on what a format cannot express, as comment lines."""
    return [f"NOT EXPORTED: {text}" for text in unsupported]


def measured_lines(pair: MeasuredPair) -> list[str]:
    """Returns the measurement as comment lines."""
    lines = [f"Static friction of {pair.name}, measured with a tilting plate ({_count(pair)})."]
    if pair.isotropic:
        lines.append(f"mu {pair.mu_1:.4f}{_interval(pair.mu_1_interval)} in every direction: {_degrees(pair.mu_1)}.")
    else:
        lines += [
            f"mu_1 {pair.mu_1:.4f}{_interval(pair.mu_1_interval)} along {math.degrees(pair.axis_rad):.1f} degrees from "
            f"x of the {pair.fixed_in} ({_degrees(pair.mu_1)}),",
            f"mu_2 {pair.mu_2:.4f}{_interval(pair.mu_2_interval)} across it ({_degrees(pair.mu_2)}); "
            "between them an ellipse.",
        ]
    if (pair.side_m, pair.mass_kg) == (SIDE_M, MASS_KG):
        lines.append("The bodies are a cube of 10 mm and 7.85 g on a plate; friction does not depend on them.")
    else:
        lines.append(f"The object is a cube of {pair.side_m * 1e3:.4g} mm and {pair.mass_kg * 1e3:.4g} g.")
    return lines


def xml_comment(lines: Sequence[str]) -> str:
    """Returns lines as a comment of XML; two hyphens in a row, which XML does not allow there, are parted."""
    clean = [f"  {line}" for line in _wrapped(lines)]
    return "\n".join(["<!--", *(re.sub(r"-(?=-)", "- ", line) for line in clean), "-->"])


def hashed(lines: Sequence[str]) -> str:
    """Returns lines as a comment of Python and USD."""
    return "\n".join(f"# {line}" for line in _wrapped(lines))


def _wrapped(lines: Sequence[str]) -> list[str]:
    return [part for line in lines for part in textwrap.wrap(line, _WIDTH, subsequent_indent="  ")]


def number(value: float) -> str:
    """Returns a number with the ten digits that a simulator's file needs at most."""
    return f"{value + 0.0:.10g}"


def _count(pair: MeasuredPair) -> str:
    return counted(pair.samples) if pair.samples else "number of samples not stated"


def _interval(ends: tuple[float, float]) -> str:
    return f" (90 % interval {ends[0]:.4f} to {ends[1]:.4f})" if all(map(math.isfinite, ends)) else ""


def _degrees(mu: float) -> str:
    return f"slides at {math.degrees(math.atan(mu)):.2f} degrees"
