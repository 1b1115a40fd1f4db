"""The picture of a camera without pixels in a simulated session: blank as recorded, with the simulated corners."""

from __future__ import annotations

from collections.abc import Iterator

from shared import frames
from shared.foxglove import CameraCalibration, CompressedImage
from shared.messages import CameraGeometry, MarkerCorners, Message
from shared.pictures import unpacked
from station.recording.reader import Recorded

IMAGE, OVERLAY = "camera/image", "camera/image/overlay"
MOVED_PX = 0.5
"""Corners are drawn anew when they have moved so far: less is not seen in a viewer."""

TopicMessage = tuple[str, Message]


class SimulatedPicture:
    """Says what of the recorded picture holds in the simulation: one that shows nothing contradicts nothing."""

    def __init__(self) -> None:
        self._lens: CameraCalibration | None = None
        self._geometry: CameraGeometry | None = None
        self._is_blank = False
        self._shown_px: tuple[float, ...] = ()

    def take(self, item: Recorded) -> Iterator[TopicMessage]:
        """Yields the picture, if it is blank; lens and geometry are remembered."""
        message = item.message
        if isinstance(message, CameraCalibration):
            self._lens = message
        elif isinstance(message, CameraGeometry):
            self._geometry = message.if_calibrated()
        elif isinstance(message, CompressedImage) and item.topic == IMAGE and _is_blank(message):
            self._is_blank = True
            yield item.topic, message

    def overlay(self, corners: MarkerCorners) -> Iterator[TopicMessage]:
        """Yields the simulated corners over the blank picture, where they have moved."""
        lens, geometry = self._lens, self._geometry
        if not self._is_blank or lens is None or geometry is None or not self._has_moved(corners):
            return
        self._shown_px = corners.corners_px
        depth_m, stamp_ns = geometry.camera_height_m - geometry.mark_height_m, corners.capture_ns
        yield OVERLAY, frames.overlay(corners.corners_px, K=lens.K, depth_m=depth_m, stamp_ns=stamp_ns)

    def _has_moved(self, corners: MarkerCorners) -> bool:
        if len(corners.corners_px) != len(self._shown_px):
            return True
        return any(abs(a - b) >= MOVED_PX for a, b in zip(corners.corners_px, self._shown_px, strict=True))


def _is_blank(image: CompressedImage) -> bool:
    shown = unpacked(image.data)
    return shown is not None and int(shown.min()) == int(shown.max())
