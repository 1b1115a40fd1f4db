"""The mark's corners over the camera's image, and the state in words; Foxglove draws them.

Foxglove counts pixels from the top-left pixel's outer corner, OpenCV from its centre.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import ClassVar

from shared.foxglove import Timestamp
from shared.foxglove_annotations import LINE_LOOP, Color, ImageAnnotations, Point2, PointsAnnotation, TextAnnotation
from shared.frames import OVERLAY_RGBA, PIXEL_CENTRE
from shared.messages import MarkerCorners, Message
from shared.rig import RigConfig
from station.recording.viewers.extra import Extra, Handler, Pace, coarse, foxglove
from station.recording.viewers.state import STATE_TOPICS, State
from station.rig.placed_arm import PlacedArm

TOPIC = "camera/annotations"
_STILL_PX = 0.25
"""Corners are drawn anew when one has moved by more: a sixth of the line's width, which no eye sees."""
_LINE_PX, _FONT_PX = 1.5, 22.0
_TEXT_AT = Point2(10.0, 34.0)
_MARK = Color(*(part / 255.0 for part in OVERLAY_RGBA))
_WORDS, _BEHIND_WORDS = Color(1.0, 1.0, 1.0, 1.0), Color(0.0, 0.0, 0.0, 0.5)


class CameraAnnotations:
    """Draws the mark's corners and the state in words over the camera's image."""

    topics: ClassVar[frozenset[str]] = frozenset({TOPIC})

    def __init__(self, _rig: RigConfig, _arm: PlacedArm) -> None:
        self._state, self._pace = State(), Pace()
        self._drawn: tuple[str, tuple[float, ...]] | None = None

    def handlers(self) -> Mapping[str, Handler]:
        """Returns the handlers of the corners and of the topics that the state is made of."""
        return {"camera/corners": self._on_corners} | dict.fromkeys(STATE_TOPICS, self._on_state)

    def _on_state(self, message: Message, _: int) -> tuple[()]:
        self._state.take(message)
        return ()

    def _on_corners(self, corners: MarkerCorners, stamp_ns: int) -> Iterable[Extra]:
        if not self._pace.due(stamp_ns):
            return
        lost = "" if corners.found else f"no mark: {corners.reason}"
        words = ", ".join(part for part in (self._state.present(), lost) if part)
        corners_px = corners.corners_px if corners.found else ()
        if self._same(words, corners_px):
            return
        self._pace.written(stamp_ns)
        self._drawn = words, corners_px
        yield foxglove(TOPIC, _annotations(words, corners_px, Timestamp.from_ns(stamp_ns)))

    def _same(self, words: str, corners_px: tuple[float, ...]) -> bool:
        if self._drawn is None or self._drawn[0] != words or len(self._drawn[1]) != len(corners_px):
            return False
        return all(abs(now - then) <= _STILL_PX for now, then in zip(corners_px, self._drawn[1], strict=True))


def _annotations(words: str, corners_px: tuple[float, ...], timestamp: Timestamp) -> ImageAnnotations:
    points = tuple(
        Point2(coarse(x + PIXEL_CENTRE), coarse(y + PIXEL_CENTRE))
        for x, y in zip(corners_px[::2], corners_px[1::2], strict=True)
    )
    mark = PointsAnnotation(timestamp, LINE_LOOP, points, outline_color=_MARK, thickness=_LINE_PX)
    text = TextAnnotation(timestamp, _TEXT_AT, words, _FONT_PX, _WORDS, _BEHIND_WORDS)
    return ImageAnnotations(timestamp, points=(mark,) if points else (), texts=(text,) if words else ())
