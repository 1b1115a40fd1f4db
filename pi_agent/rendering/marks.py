"""Describes a mark as it is painted: layers of polygons of one reflectance each, in the mark's frame (mm)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking.mark import (
    DOT_PLACE,
    DOT_RADIUS,
    NOTCH_PLACE,
    NOTCH_SIZE,
    TAG_BORDER,
    Mark,
    rectangle,
    tag_bits,
)

Points = NDArray[np.float64]


@dataclass(frozen=True)
class Layer:
    """Polygons (each (n, 2), clockwise as seen, not overlapping) of one reflectance, painted at one go."""

    polygons: tuple[Points, ...]
    reflectance: float


@dataclass(frozen=True)
class Ink:
    """Reflectances (fractions of white light) of the dark square and of the white around and inside it."""

    dark: float = 0.06
    white: float = 0.80


def mark_layers(mark: Mark, ink: Ink) -> tuple[Layer, ...]:
    """Returns the layers that are painted, in order: margin, dark square, feature."""
    margin = (Layer((mark.outline_mm(),), ink.white),) if mark.margin > 0 else ()
    return (*margin, Layer((mark.corners_mm(),), ink.dark), *_feature(mark, ink))


def disc(radius: float, *, sides: int = 48) -> Points:
    """Returns a regular polygon (sides, 2) of the disc's area, clockwise as seen."""
    angle = np.arange(sides) * (2 * np.pi / sides)
    scale = radius * np.sqrt(2 * np.pi / sides / np.sin(2 * np.pi / sides))
    return scale * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _feature(mark: Mark, ink: Ink) -> tuple[Layer, ...]:
    size = mark.size_mm
    if mark.feature == "dot":
        return (Layer((DOT_PLACE * size + disc(DOT_RADIUS * mark.side_mm),), ink.white),)
    if mark.feature == "notch":
        width, depth = NOTCH_SIZE[0] * size[0], NOTCH_SIZE[1] * size[1]
        middle = np.array([NOTCH_PLACE * size[0], 0.5 * (depth - size[1])])
        return (Layer((rectangle(width, depth) + middle,), ink.white),)
    return (_tag(mark, ink),) if mark.feature == "tag" else ()


def _tag(mark: Mark, ink: Ink) -> Layer:
    bits = tag_bits(mark.tag_dictionary, mark.tag_id)
    cell = mark.size_mm / (len(bits) + 2 * TAG_BORDER)
    places = (np.argwhere(bits > 0)[:, ::-1] + TAG_BORDER + 0.5) * cell - 0.5 * mark.size_mm
    return Layer(tuple(rectangle(cell[0], cell[1]) + place for place in places), ink.white)
