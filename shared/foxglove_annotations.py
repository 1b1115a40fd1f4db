"""Foxglove's drawings on a camera image. Pixel coordinates count from the top-left pixel's outer corner."""

from __future__ import annotations

from dataclasses import dataclass

from shared.foxglove import FoxgloveMessage, Timestamp, numbered

LINE_LOOP = 2
"""The points are a closed line."""


@dataclass(frozen=True, slots=True)
class Color(FoxgloveMessage):
    """Red, green, blue and opacity, each from 0 to 1."""

    r: float = 0.0
    g: float = 0.0
    b: float = 0.0
    a: float = 0.0


@dataclass(frozen=True, slots=True)
class Point2(FoxgloveMessage):
    """A place in the image, in pixels."""

    x: float = 0.0
    y: float = 0.0


@dataclass(frozen=True, slots=True)
class KeyValuePair(FoxgloveMessage):
    """A name with its value."""

    key: str = ""
    value: str = ""


@dataclass(frozen=True, slots=True)
class CircleAnnotation(FoxgloveMessage):
    """A circle; `diameter` and `thickness` are in pixels."""

    timestamp: Timestamp = Timestamp()
    position: Point2 = Point2()
    diameter: float = 0.0
    thickness: float = 0.0
    fill_color: Color = Color()
    outline_color: Color = Color()
    metadata: tuple[KeyValuePair, ...] = ()


@dataclass(frozen=True, slots=True)
class PointsAnnotation(FoxgloveMessage):
    """Points or lines; `type` is such as `LINE_LOOP`, `thickness` in pixels."""

    timestamp: Timestamp = Timestamp()
    type: int = numbered(2, 0, "enum:PointsAnnotation.Type")
    points: tuple[Point2, ...] = ()
    outline_color: Color = Color()
    outline_colors: tuple[Color, ...] = ()
    fill_color: Color = Color()
    thickness: float = 0.0
    metadata: tuple[KeyValuePair, ...] = ()


@dataclass(frozen=True, slots=True)
class TextAnnotation(FoxgloveMessage):
    """A text whose lower left corner is at `position`; `font_size` is in pixels."""

    timestamp: Timestamp = Timestamp()
    position: Point2 = Point2()
    text: str = ""
    font_size: float = 0.0
    text_color: Color = Color()
    background_color: Color = Color()
    metadata: tuple[KeyValuePair, ...] = ()


@dataclass(frozen=True, slots=True)
class ImageAnnotations(FoxgloveMessage):
    """All that is drawn on the image; it takes the place of the message before."""

    timestamp: Timestamp = numbered(5, Timestamp())
    circles: tuple[CircleAnnotation, ...] = numbered(1, ())
    points: tuple[PointsAnnotation, ...] = numbered(2, ())
    texts: tuple[TextAnnotation, ...] = numbered(3, ())
    metadata: tuple[KeyValuePair, ...] = numbered(4, ())
