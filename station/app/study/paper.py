"""The figures that the paper prints of its four surface pairs (section V, Table III), and their digits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

SAMPLES = 6330
"""All samples. How they are divided among the pairs the paper does not say: we give each a quarter."""
FILTERED = 552
SECONDS_PER_SAMPLE = 22.0
"""Seconds for a sample on average (section V), which is all that the paper says of its arm's speed."""


@dataclass(frozen=True, kw_only=True)
class PaperPair:
    """A surface pair as the paper gives it; `preset` is the name of the twin's pair.

    `mean_rad` and `scatter` (standard deviation over mean) are printed to within `mean_to_rad` and `scatter_to`, half
    of the last digit's unit. `unique` and `by_filter` are the rows of Table III, numbers of samples. `source` says
    where the mean is from.
    """

    preset: str
    object: str
    plate: str
    mean_rad: float
    mean_to_rad: float
    scatter: float
    scatter_to: float
    anisotropic: bool
    unique: int
    by_filter: Mapping[str, int]
    source: str

    @property
    def name(self) -> str:
        """The name as the paper writes it."""
        return f"{self.object} on {self.plate}"


def _filters(distance: int, angle: int, circumference: int, border: int) -> Mapping[str, int]:
    return {"distance": distance, "angle": angle, "circumference": circumference, "border": border}


PAIRS = (
    PaperPair(
        preset="steel_on_steel",
        object="steel",
        plate="steel",
        mean_rad=0.35,
        mean_to_rad=0.005,
        scatter=0.20,
        scatter_to=0.05,
        anisotropic=False,
        unique=138,
        by_filter=_filters(50, 14, 35, 82),
        source='"0.35 radian"',
    ),
    PaperPair(
        preset="wood_on_wood",
        object="wood",
        plate="wood",
        mean_rad=0.39,
        mean_to_rad=0.02,
        scatter=0.10,
        scatter_to=0.05,
        anisotropic=True,
        unique=49,
        by_filter=_filters(21, 6, 4, 24),
        source='no number printed: 0.35 rad and the "difference of around 0.04 radians"',
    ),
    PaperPair(
        preset="steel_on_wood",
        object="steel",
        plate="wood",
        mean_rad=0.20,
        mean_to_rad=0.05,
        scatter=0.10,
        scatter_to=0.05,
        anisotropic=False,
        unique=228,
        by_filter=_filters(84, 27, 20, 102),
        source='"around 0.2 radian on average"',
    ),
    PaperPair(
        preset="wood_on_steel",
        object="wood",
        plate="steel",
        mean_rad=0.20,
        mean_to_rad=0.05,
        scatter=0.10,
        scatter_to=0.05,
        anisotropic=False,
        unique=137,
        by_filter=_filters(7, 10, 5, 121),
        source='"around 0.2 radian on average"',
    ),
)


def flags_of(name: str) -> int:
    """Returns the number of samples of all pairs that a filter flagged."""
    return sum(pair.by_filter[name] for pair in PAIRS)
