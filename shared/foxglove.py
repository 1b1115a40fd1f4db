"""The Foxglove schemas that viewers understand unaided, as frozen dataclasses with their published field numbers.

A test compares them with the published package. Field numbers and fixed-width types stand in the metadata, because
they do not follow the order of the fields as our own messages' do.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

from shared.messages import Floats, Message
from shared.pictures import too_large
from shared.possible import counted, dated, measurable


def numbered(number: int, default: Any, kind: str = "") -> Any:
    """Returns a field with its published number.

    `kind` is protobuf's name of its type where the default does not tell it.
    """
    return field(default=default, metadata={"number": number, "kind": kind})


@dataclass(frozen=True, slots=True)
class Timestamp(Message):
    """google.protobuf.Timestamp."""

    PACKAGE: ClassVar[str] = "google.protobuf"
    seconds: int = 0
    nanos: int = numbered(2, 0, "int32")

    @staticmethod
    def from_ns(stamp_ns: int) -> Timestamp:
        """Returns the timestamp of nanoseconds since the epoch."""
        seconds, nanos = divmod(stamp_ns, 1_000_000_000)
        return Timestamp(seconds, nanos)

    @property
    def ns(self) -> int:
        """Nanoseconds since the epoch."""
        return self.seconds * 1_000_000_000 + self.nanos


@dataclass(frozen=True, slots=True)
class Duration(Message):
    """google.protobuf.Duration."""

    PACKAGE: ClassVar[str] = "google.protobuf"
    seconds: int = 0
    nanos: int = numbered(2, 0, "int32")


@dataclass(frozen=True, slots=True)
class FoxgloveMessage(Message):
    """Base of the Foxglove schemas."""

    PACKAGE: ClassVar[str] = "foxglove"


@dataclass(frozen=True, slots=True)
class Vector3(FoxgloveMessage):
    """A vector in metres, or without unit."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass(frozen=True, slots=True)
class Quaternion(FoxgloveMessage):
    """A rotation; note that Foxglove puts w last."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


@dataclass(frozen=True, slots=True)
class Pose(FoxgloveMessage):
    """A position and an orientation."""

    position: Vector3 = Vector3()
    orientation: Quaternion = Quaternion()


@dataclass(frozen=True, slots=True)
class CompressedImage(FoxgloveMessage):
    """A JPEG or PNG frame."""

    timestamp: Timestamp = numbered(1, Timestamp())
    frame_id: str = numbered(4, "")
    data: bytes = numbered(2, b"")
    format: str = numbered(3, "jpeg")

    def impossible(self) -> str:
        """Names a picture that is too large to be unpacked, and a time that cannot be."""
        return dated(self.timestamp.ns) or too_large(self.data)


@dataclass(frozen=True, slots=True)
class CameraCalibration(FoxgloveMessage):
    """Intrinsics K (3×3, row by row), distortion D, rectification R (3×3), projection P (3×4)."""

    timestamp: Timestamp = numbered(1, Timestamp())
    frame_id: str = numbered(9, "")
    width: int = numbered(2, 0, "fixed32")
    height: int = numbered(3, 0, "fixed32")
    distortion_model: str = numbered(4, "")
    D: Floats = numbered(5, ())
    K: Floats = numbered(6, ())
    R: Floats = numbered(7, ())
    P: Floats = numbered(8, ())

    def impossible(self) -> str:
        """Names a wrong count in K or D, what no number or time can be, and a distortion without a focal length.

        D is OpenCV's k1, k2, p1, p2 and, if given, k3, in units of K's focal lengths.
        """
        wrong = dated(self.timestamp.ns)
        wrong = (
            wrong
            or counted("K", self.K, 0, 9)
            or counted("D", self.D, 0, 4, 5)
            or measurable("K and D", (*self.K, *self.D))
        )
        if not wrong and any(self.D) and not (self.K and self.K[0] and self.K[4]):
            wrong = f"{self.K} as K, without a focal length for its distortion D"
        return wrong


@dataclass(frozen=True, slots=True)
class FrameTransform(FoxgloveMessage):
    """parent_from_child. Always set translation and rotation: viewers refuse unset ones."""

    timestamp: Timestamp = numbered(1, Timestamp())
    parent_frame_id: str = numbered(2, "")
    child_frame_id: str = numbered(3, "")
    translation: Vector3 = numbered(4, Vector3())
    rotation: Quaternion = numbered(5, Quaternion())


@dataclass(frozen=True, slots=True)
class FrameTransforms(FoxgloveMessage):
    """Several transforms of one moment."""

    transforms: tuple[FrameTransform, ...] = ()

    def impossible(self) -> str:
        """Names times that cannot be."""
        return dated(*(one.timestamp.ns for one in self.transforms))


@dataclass(frozen=True, slots=True)
class PackedElementField(FoxgloveMessage):
    """One field of a packed point; `type` 7 is float32."""

    name: str = ""
    offset: int = numbered(2, 0, "fixed32")
    type: int = numbered(3, 0, "enum:PackedElementField.NumericType")


@dataclass(frozen=True, slots=True)
class PointCloud(FoxgloveMessage):
    """Points packed into bytes; overlaid on the image when its frame is the camera's."""

    timestamp: Timestamp = numbered(1, Timestamp())
    frame_id: str = numbered(2, "")
    pose: Pose = numbered(3, Pose())
    point_stride: int = numbered(4, 0, "fixed32")
    fields: tuple[PackedElementField, ...] = numbered(5, ())
    data: bytes = numbered(6, b"")

    def impossible(self) -> str:
        """Names a time that cannot be."""
        return dated(self.timestamp.ns)


LEVELS = {"debug": 1, "info": 2, "warning": 3, "error": 4, "fatal": 5}


@dataclass(frozen=True, slots=True)
class Log(FoxgloveMessage):
    """One line of a process's log; `level` is one of `LEVELS`, `name` the process."""

    timestamp: Timestamp = numbered(1, Timestamp())
    level: int = numbered(2, 0, "enum:Log.Level")
    message: str = numbered(3, "")
    name: str = numbered(4, "")
    file: str = numbered(5, "")
    line: int = numbered(6, 0, "fixed32")

    def impossible(self) -> str:
        """Names a time that cannot be."""
        return dated(self.timestamp.ns)


ENUMS = {
    "PackedElementField.NumericType": (
        "UNKNOWN",
        "UINT8",
        "INT8",
        "UINT16",
        "INT16",
        "UINT32",
        "INT32",
        "FLOAT32",
        "FLOAT64",
    ),
    "Log.Level": ("UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"),
    "PointsAnnotation.Type": ("UNKNOWN", "POINTS", "LINE_LOOP", "LINE_STRIP", "LINE_LIST"),
}
"""The values of each enum in the order of their numbers; the message that it stands in precedes the point."""
