"""The choice of the next tilting direction: random, with more weight where the block can slide far (section IV)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from station.sampling.plan import DirectionPlan

FREE = -1
FREE_CHOICES = 360


@dataclass(frozen=True, slots=True)
class Direction:
    """A tilting direction: its number (0–3, or −1 for a free azimuth) and the azimuth β of the tilting axis."""

    number: int
    azimuth_rad: float

    @property
    def sector(self) -> int:
        """The nearest of the four directions: runs of one sector share their range of angles."""
        return round(self.azimuth_rad / (math.pi / 2)) % 4


def candidates(plan: DirectionPlan) -> tuple[Direction, ...]:
    """Returns all directions that may be chosen."""
    if plan.mode == "four":
        return tuple(Direction(number, number * math.pi / 2) for number in sorted(set(plan.some)))
    return tuple(Direction(FREE, k * 2 * math.pi / FREE_CHOICES) for k in range(FREE_CHOICES))


def slide_in_image(azimuth_rad: float) -> tuple[float, float]:
    """Returns the unit vector in the image (x right, y down) along which the block slides when tilted at β.

    Downhill in the plate frame is t × k = (sin β, −cos β) (paper, equation 4); the image's y is the plate's −y.
    """
    return math.sin(azimuth_rad), math.cos(azimuth_rad)


def distance_to_border_px(centre_px: tuple[float, float], *, azimuth_rad: float, size_px: tuple[int, int]) -> float:
    """Returns the distance of the block's centre from the image's border along its slide, in pixels.

    It is 0 outside the image.
    """
    distances = []
    for place, step, length in zip(centre_px, slide_in_image(azimuth_rad), size_px, strict=True):
        if abs(step) > 1e-9:
            distances.append(((length - 1 - place) if step > 0 else place) / abs(step))
    return max(0.0, min(distances))


def choose(
    plan: DirectionPlan,
    *,
    centre_px: tuple[float, float],
    size_px: tuple[int, int],
    rng: np.random.Generator,
    way_px: Callable[[Direction], float] = lambda _: math.inf,
) -> Direction:
    """Draws the next direction. Shorter slides keep a chance, so that it does not only go back and forth.

    `way_px` is how far the foam lets the block slide. A block at the foam is thereby moved away from it; where it can
    slide far enough in no direction, it takes one of the farthest ways.
    """
    options = candidates(plan)
    ways = np.array([way_px(option) for option in options])
    distances = np.array(
        [distance_to_border_px(centre_px, azimuth_rad=option.azimuth_rad, size_px=size_px) for option in options]
    )
    usable = np.where(np.minimum(distances, ways) >= plan.min_slide_px, distances, 0.0)
    if not usable.any():
        usable = np.where(ways >= ways.max(), np.maximum(distances, 1e-6), 0.0)
    # Shares of the farthest way: the power of a distance in pixels may be infinite.
    weights = (usable / usable.max()) ** plan.distance_power * (usable > 0)
    return options[int(rng.choice(len(options), p=weights / weights.sum()))]
