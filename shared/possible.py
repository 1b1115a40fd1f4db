"""The faults that make a message impossible, in words that follow "got"; empty where there is none."""

from __future__ import annotations

import math
import sys
from collections.abc import Collection, Iterator, Sequence
from dataclasses import fields
from typing import Any

SHORTEST, LONGEST = 0.5, 2.0
"""The lengths of a quaternion, without unit, that may be a rotation's: 1 but for rounding, which even in half precision
is below 0.001. Trackers that lost their target write zeros, and what is read from other bytes is far from both."""


LARGEST = 1e9
"""The largest number that a rig measures, in whatever unit it is written: the square of one far beyond is infinite."""

LEAST = 1e-9
"""The least size, mass or rate that a rig has, in whatever unit it is written: the square of one far below is zero."""

FARTHEST_M = 100.0
"""The farthest that a plate's pivot is from its place when level, m: the longest arms reach 3 m."""


def counted(name: str, values: Sequence[float], *counts: int) -> str:
    """Returns a fault, unless there are as many values as one of `counts`."""
    expected = " or ".join(str(count) for count in counts)
    return "" if len(values) in counts else f"{len(values)} numbers as {name}, which has {expected}"


def some(name: str, values: Sequence[float]) -> str:
    """Returns a fault, if there is no value at all."""
    return "" if values else f"no {name}"


def measurable(name: str, values: Sequence[float], *, most: float = LARGEST) -> str:
    """Returns a fault, unless every value is a number of at most `most`, without its sign."""
    return "" if all(-most <= value <= most for value in values) else f"{tuple(values)} as {name}"


def require_measurable(settings: Any, *, but: Collection[str] = ()) -> None:
    """Refuses a dataclass of settings with a number that no rig has, in whatever unit; the fields `but` are not asked.

    TOML has nan, which would pass every comparison that follows.

    Raises:
        ValueError: if a number, or one in a list, is not finite or beyond LARGEST without its sign.
    """
    for spec in fields(settings):
        for one in () if spec.name in but else _numbers(getattr(settings, spec.name)):
            if not abs(one) <= LARGEST:
                raise ValueError(f"expected a finite number of at most {LARGEST:g} for '{spec.name}', got {one}")


def _numbers(value: Any) -> Iterator[float]:
    if isinstance(value, tuple):
        for one in value:  # pyright: ignore[reportUnknownVariableType]
            yield from _numbers(one)
    elif isinstance(value, int | float):
        yield value


def measurable_if_known(name: str, values: Sequence[float]) -> str:
    """Returns a fault as `measurable`, but for values of nan, by which a sender says that it does not know them."""
    return measurable(name, [value for value in values if not math.isnan(value)])


def sized(name: str, value: float) -> str:
    """Returns a fault, unless a size or a mass is 0, which says that it is not known, or one that a rig has."""
    return "" if value == 0.0 or LEAST <= value <= LARGEST else f"{value} as {name}"


def dated(*stamps_ns: int) -> str:
    """Returns a fault, unless times since the epoch, ns, fit into the 63 bits of our own stamps and of a recording."""
    return "" if all(abs(stamp_ns) < 1 << 63 for stamp_ns in stamps_ns) else f"{stamps_ns} ns as a time"


def turned(*quaternion: float) -> str:
    """Returns a fault, unless the quaternion is about as long as that of a rotation."""
    return "" if SHORTEST <= math.hypot(*quaternion) <= LONGEST else f"{quaternion} as a quaternion"


_ROUNDING = 16 * sys.float_info.epsilon
"""A determinant of nine numbers is known to so much of the product of its rows' lengths, without unit: each of its six
products and five sums rounds by at most half of an epsilon (Higham 2002, section 3.1). Below that it may be zero."""


def invertible(name: str, matrix: Sequence[float]) -> str:
    """Returns a fault, unless nine numbers, row by row, map a plane to a plane.

    A plane is mapped to a plane if the determinant is finite and not zero.
    """
    rows = math.hypot(*matrix[:3]), math.hypot(*matrix[3:6]), math.hypot(*matrix[6:])
    a, b, c, d, e, f, g, h, i = matrix
    determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    sure = math.isfinite(determinant) and abs(determinant) > _ROUNDING * math.prod(rows)
    return "" if sure else f"{tuple(matrix)} as {name}, which cannot be inverted"
