"""The Foxglove schemas that viewers understand unaided, as frozen dataclasses with their published field numbers.

A test compares them with the published package. Field numbers and fixed-width types stand in the metadata, because
they do not follow the order of the fields as our own messages' do.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

from shared.messages import Floats, Message


def _field(number: int, default: Any, kind: str = "") -> Any:
    return field(default=default, metadata={"number": number, "kind": kind})


@dataclass(frozen=True, slots=True)
class Timestamp(Message):
    """google.protobuf.Timestamp."""

    PACKAGE: ClassVar[str] = "google.protobuf"
    seconds: int = 0
    nanos: int = _field(2, 0, "int32")

    @staticmethod
    def from_ns(stamp_ns: int) -> Timestamp:
        """The timestamp of nanoseconds since the epoch."""
        seconds, nanos = divmod(stamp_ns, 1_000_000_000)
        return Timestamp(seconds, nanos)

    @property
    def ns(self) -> int:
        """Nanoseconds since the epoch."""
        return self.seconds * 1_000_000_000 + self.nanos


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

    timestamp: Timestamp = _field(1, Timestamp())
    frame_id: str = _field(4, "")
    data: bytes = _field(2, b"")
    format: str = _field(3, "jpeg")


@dataclass(frozen=True, slots=True)
class CameraCalibration(FoxgloveMessage):
    """Intrinsics K (3×3, row by row), distortion D, rectification R (3×3), projection P (3×4)."""

    timestamp: Timestamp = _field(1, Timestamp())
    frame_id: str = _field(9, "")
    width: int = _field(2, 0, "fixed32")
    height: int = _field(3, 0, "fixed32")
    distortion_model: str = _field(4, "")
    D: Floats = _field(5, ())
    K: Floats = _field(6, ())
    R: Floats = _field(7, ())
    P: Floats = _field(8, ())


@dataclass(frozen=True, slots=True)
class FrameTransform(FoxgloveMessage):
    """parent_from_child. Always set translation and rotation: viewers refuse unset ones."""

    timestamp: Timestamp = _field(1, Timestamp())
    parent_frame_id: str = _field(2, "")
    child_frame_id: str = _field(3, "")
    translation: Vector3 = _field(4, Vector3())
    rotation: Quaternion = _field(5, Quaternion())


@dataclass(frozen=True, slots=True)
class FrameTransforms(FoxgloveMessage):
    """Several transforms of one moment."""

    transforms: tuple[FrameTransform, ...] = ()


@dataclass(frozen=True, slots=True)
class PackedElementField(FoxgloveMessage):
    """One field of a packed point; `type` 7 is float32."""

    name: str = ""
    offset: int = _field(2, 0, "fixed32")
    type: int = _field(3, 0, "enum:NumericType")


@dataclass(frozen=True, slots=True)
class PointCloud(FoxgloveMessage):
    """Points packed into bytes; overlaid on the image when its frame is the camera's."""

    timestamp: Timestamp = _field(1, Timestamp())
    frame_id: str = _field(2, "")
    pose: Pose = _field(3, Pose())
    point_stride: int = _field(4, 0, "fixed32")
    fields: tuple[PackedElementField, ...] = _field(5, ())
    data: bytes = _field(6, b"")


LEVELS = {"debug": 1, "info": 2, "warning": 3, "error": 4, "fatal": 5}


@dataclass(frozen=True, slots=True)
class Log(FoxgloveMessage):
    """One line of a process's log; `level` is one of `LEVELS`, `name` the process."""

    timestamp: Timestamp = _field(1, Timestamp())
    level: int = _field(2, 0, "enum:LogLevel")
    message: str = _field(3, "")
    name: str = _field(4, "")
    file: str = _field(5, "")
    line: int = _field(6, 0, "fixed32")


ENUMS = {
    "NumericType": ("UNKNOWN", "UINT8", "INT8", "UINT16", "INT16", "UINT32", "INT32", "FLOAT32", "FLOAT64"),
    "LogLevel": ("UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"),
}
