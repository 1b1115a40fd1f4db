"""Compares a recording's corners with those that its pictures show: by the camera agent's tracker, run again.

Pictures are packed (JPEG) and come a few times a second, so the tracker sees less than it saw live, and its corners
differ by what that makes. What it has learned of the mark's shape in a packed picture before goes into the next one's
reading, which moved a slide's corners by .07 px; a picture that is read by itself has none of that. A corner that
differs from both readings by more than their errors was not read from this picture.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from typing import Literal, Protocol

from shared.foxglove import CompressedImage
from shared.messages import MarkerCorners
from shared.rig import RigConfig
from station.app.camera_agent import borrowed
from station.recording.reader import RecordingReader

GROUP = "repose.picture_tracker"
WAITING = 6000
"""Corners that wait for their picture: more than a minute of them at 90 Hz, where a picture asked for is half a minute
late at most."""
SIGMAS = 8.0
FLOOR_PX = 0.1
"""A corner agrees with its picture within this many standard deviations of the new reading (the recorded one is a
stranger's word), or within this many pixels. Of 3141 pictures packed at the quality of rig files (80) the worst was
.070 px off, by 6.2 of these deviations, and .062 px by the nearer of both readings (`station run --lockstep --pixels
--samples 5` with seeds 1, 2, 3, 5, 11, then `station verify`); `pytest tests/unit/app/test_verify_corners.py` prints 80
pictures' worst. Of 169 fiducials of the plate the worst was .072 px off, by 4.6 deviations (`--samples 1`, seeds 1
and 2)."""


MarkTopic = Literal["camera/corners", "camera/plate"]


class PictureTracker(Protocol):
    """The camera agent's tracker of recorded pictures."""

    def corners(self, picture: bytes, *, like: MarkerCorners) -> MarkerCorners | None:
        """Returns the corners of the mark of `like` in its picture; None if it is no picture of the rig's camera."""
        ...

    def alone(self, picture: bytes, *, like: MarkerCorners) -> MarkerCorners | None:
        """Returns the same, read without anything that earlier pictures have shown."""
        ...


@dataclass(frozen=True, slots=True)
class OtherCorner:
    """A corner that its picture does not show: which of the eight coordinates, as recorded and as read again."""

    stamp_ns: int
    number: int
    recorded_px: float
    derived_px: float


@dataclass
class CornersAgain:
    """The numbers of pictures and of those in which the mark was read again, and what differs.

    `corners`: how many corners of the mark are recorded, of which most frames have no picture;
    `unseen`: pictures in which the mark was found then and not now; `worst_px`: the largest difference of a coordinate;
    `stampless`: pictures of a time from which no corners are recorded.
    """

    corners: int = 0
    pictures: int = 0
    compared: int = 0
    unseen: int = 0
    stampless: int = 0
    worst_px: float = 0.0
    different: int = 0
    first: OtherCorner | None = None

    def take(self, recorded: MarkerCorners, derived: MarkerCorners | None) -> None:
        """Compares one picture's corners."""
        self.pictures += 1
        if not recorded.found:
            return
        if derived is None or not derived.found:
            self.unseen += 1
            return
        self.compared += 1
        size, number = apart_px(recorded, derived)
        self.worst_px = max(self.worst_px, size)
        if size > allowed_px(derived):
            self.different += 1
            self.first = self.first or OtherCorner(
                recorded.capture_ns, number, recorded.corners_px[number], derived.corners_px[number]
            )


def allowed_px(derived: MarkerCorners) -> float:
    """Returns the largest difference, px, of a recorded coordinate from the one that was read again."""
    return max(FLOOR_PX, SIGMAS * derived.sigma_px)


def apart_px(recorded: MarkerCorners, derived: MarkerCorners) -> tuple[float, int]:
    """Returns the largest difference, px, of a coordinate from the one that was read again, and which one it is."""
    pairs = zip(recorded.corners_px, derived.corners_px, strict=True)
    return max((abs(one - other), number) for number, (one, other) in enumerate(pairs))


def corners_again(
    reader: RecordingReader, tracker: PictureTracker, *, topic: MarkTopic = "camera/corners"
) -> CornersAgain:
    """Reads marks in every recorded picture again and compares them with the corners of the same capture time.

    They are those of `topic`: the block's, or the plate's, of which a picture may show several.
    """
    found, waiting = CornersAgain(), OrderedDict[int, list[MarkerCorners]]()
    for item in reader.messages({topic, "camera/image"}):
        message = item.message
        if isinstance(message, MarkerCorners):
            found.corners += message.found
            waiting.setdefault(message.capture_ns, []).append(message)
            if len(waiting) > WAITING:
                waiting.popitem(last=False)
        elif isinstance(message, CompressedImage):
            found.stampless += message.timestamp.ns not in waiting
            for recorded in waiting.get(message.timestamp.ns, ()):
                found.take(recorded, _nearer(tracker, message.data, recorded))
    return found


def _nearer(tracker: PictureTracker, picture: bytes, recorded: MarkerCorners) -> MarkerCorners | None:
    """Returns the corners as the tracker follows them, or, where these differ, as the picture by itself shows them."""
    followed = tracker.corners(picture, like=recorded)
    if followed is None or not recorded.found or _agree(recorded, followed):
        return followed
    alone = tracker.alone(picture, like=recorded)
    return alone if alone is not None and _agree(recorded, alone) else followed


def _agree(recorded: MarkerCorners, derived: MarkerCorners) -> bool:
    return derived.found and apart_px(recorded, derived)[0] <= allowed_px(derived)


def picture_tracker(rig: RigConfig, calibration_toml: str) -> PictureTracker:
    """Returns the camera agent's tracker for a recording's rig and calibration.

    Raises:
        UserError: if the camera agent is not installed here.
    """
    return borrowed(GROUP, "mark", to="to read the pictures again")(rig, calibration_toml)
