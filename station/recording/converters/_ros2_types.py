"""The messages of ROS 2 that our messages become. What ROS 2 has a type for gets it; all else a type of our own.

Such a type, `repose_msgs/msg/Sample` for instance, has our fields with our names (which say the units); its definition
is in the bag, so that a reader needs no package for it. Stamps in headers are the time of capture on the station's
clock, one clock for all topics; a field such as `stamp_ns` is as the sender wrote it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from shared import foxglove
from shared.fields import Slot, slots
from shared.messages import JointState, Message

_SECOND_NS = 1_000_000_000
_SCALARS = {"int64": "int64", "double": "float64", "bool": "bool", "string": "string", "bytes": "uint8[]"}
_NUMPY = {"int64": np.int64, "double": np.float64, "bool": np.bool_}
_LEVELS = {1: 10, 2: 20, 3: 30, 4: 40, 5: 50}
_DISTORTION = {"kannala_brandt": "equidistant"}
_TOPICS = {
    "arm/joints": "/joint_states",
    "camera/image": "/camera/image/compressed",
    "camera/calibration": "/camera/camera_info",
    "log": "/rosout",
    "clock": "/clock_offset",  # /clock is simulated time in ROS 2
}
"""Topics that ROS 2's tools look for under another name, or take for something else; all others keep theirs."""


@dataclass(frozen=True)
class Kind:
    """The type of a topic's messages, and what makes one of ours with the time at which it happened (ns)."""

    type_name: str
    make: Callable[[Any, int], Any]


class Ros2Types:
    """The types of ROS 2 Jazzy, and those of our own that are asked for."""

    def __init__(self) -> None:
        self.store: Typestore = get_typestore(Stores.ROS2_JAZZY)
        self._kinds: dict[type[Message], Kind] = {
            JointState: Kind("sensor_msgs/msg/JointState", self._joints),
            foxglove.CompressedImage: Kind("sensor_msgs/msg/CompressedImage", self._image),
            foxglove.CameraCalibration: Kind("sensor_msgs/msg/CameraInfo", self._camera),
            foxglove.FrameTransforms: Kind("tf2_msgs/msg/TFMessage", self._transforms),
            foxglove.Log: Kind("rcl_interfaces/msg/Log", self._log),
        }

    def encoded(self, message: Message, stamp_ns: int) -> tuple[str, bytes] | None:
        """Returns the type and the CDR of a message that happened at `stamp_ns`.

        It is None if it becomes no message of ROS 2.
        """
        kind = self.kind(type(message))
        if kind is None:
            return None
        return kind.type_name, bytes(self.store.serialize_cdr(kind.make(message, stamp_ns), kind.type_name))

    def kind(self, cls: type[Message]) -> Kind | None:
        """Gives the type that messages of a class become; None for drawings of viewers, which ROS 2 has no type for."""
        if cls not in self._kinds and cls.PACKAGE == "repose":
            self._kinds[cls] = self._own(cls)
        return self._kinds.get(cls)

    def _own(self, cls: type[Message]) -> Kind:
        name = f"repose_msgs/msg/{cls.__name__}"
        self.store.register(get_types_from_msg(definition(cls), name))
        made, fields = self.store.types[name], slots(cls)

        def make(message: Message, _: int) -> Any:
            return made(**{slot.name: _value(slot, getattr(message, slot.name)) for slot in fields})

        return Kind(name, make)

    def _new(self, type_name: str, **fields: Any) -> Any:
        return self.store.types[type_name](**fields)

    def _time(self, stamp_ns: int) -> Any:
        seconds, nanoseconds = divmod(stamp_ns, _SECOND_NS)
        return self._new("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)

    def _header(self, stamp_ns: int, frame: str) -> Any:
        return self._new("std_msgs/msg/Header", stamp=self._time(stamp_ns), frame_id=frame)

    def _joints(self, message: JointState, stamp_ns: int) -> Any:
        return self._new(
            "sensor_msgs/msg/JointState",
            header=self._header(stamp_ns, ""),
            name=list(message.name),
            position=_array(message.position_rad),
            velocity=_array(message.velocity_rad_s),
            effort=_array(message.effort_nm),
        )

    def _image(self, message: foxglove.CompressedImage, stamp_ns: int) -> Any:
        return self._new(
            "sensor_msgs/msg/CompressedImage",
            header=self._header(stamp_ns, message.frame_id),
            format=message.format,
            data=np.frombuffer(message.data, np.uint8),
        )

    def _camera(self, message: foxglove.CameraCalibration, stamp_ns: int) -> Any:
        nothing = self._new(
            "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
        )
        return self._new(
            "sensor_msgs/msg/CameraInfo",
            header=self._header(stamp_ns, message.frame_id),
            height=message.height,
            width=message.width,
            distortion_model=_DISTORTION.get(message.distortion_model, message.distortion_model),
            d=_array(message.D),
            k=_array(message.K, 9),
            r=_array(message.R, 9),
            p=_array(message.P, 12),
            binning_x=0,
            binning_y=0,
            roi=nothing,
        )

    def _transforms(self, message: foxglove.FrameTransforms, _: int) -> Any:
        return self._new("tf2_msgs/msg/TFMessage", transforms=list(map(self._transform, message.transforms)))

    def _transform(self, item: foxglove.FrameTransform) -> Any:
        at, turn = item.translation, item.rotation
        return self._new(
            "geometry_msgs/msg/TransformStamped",
            header=self._header(nanoseconds(item.timestamp), item.parent_frame_id),
            child_frame_id=item.child_frame_id,
            transform=self._new(
                "geometry_msgs/msg/Transform",
                translation=self._new("geometry_msgs/msg/Vector3", x=at.x, y=at.y, z=at.z),
                rotation=self._new("geometry_msgs/msg/Quaternion", x=turn.x, y=turn.y, z=turn.z, w=turn.w),
            ),
        )

    def _log(self, message: foxglove.Log, stamp_ns: int) -> Any:
        return self._new(
            "rcl_interfaces/msg/Log",
            stamp=self._time(stamp_ns),
            level=_LEVELS.get(message.level, 0),
            name=message.name,
            msg=message.message,
            file=message.file,
            function="",
            line=message.line,
        )


def ros_topic(name: str) -> str:
    """Returns the topic's name in ROS 2, whose names know no hyphen, dot or other sign."""
    plain = "".join(letter if letter.isascii() and (letter.isalnum() or letter in "_/") else "_" for letter in name)
    return _TOPICS.get(name, f"/{plain}")


def definition(cls: type[Message]) -> str:
    """Returns the definition of our own type for a class of messages, as ROS 2 writes it: a line for each field."""
    lines = (f"{_SCALARS[slot.wire_kind]}{'[]' if slot.repeated else ''} {slot.name}" for slot in slots(cls))
    return "\n".join(lines) + "\n"


def nanoseconds(stamp: foxglove.Timestamp) -> int:
    """Returns a stamp in nanoseconds."""
    return stamp.seconds * _SECOND_NS + stamp.nanos


def _value(slot: Slot, value: Any) -> Any:
    if slot.repeated and slot.wire_kind in _NUMPY:
        return np.asarray(value, dtype=_NUMPY[slot.wire_kind])
    return list(value) if slot.repeated else value


def _array(values: Sequence[float], count: int | None = None) -> Any:
    """Returns the numbers.

    They are zeros where a fixed count is wanted and there are none, which ROS 2 takes as not calibrated.
    """
    if count is not None and len(values) != count:
        return np.zeros(count)
    return np.asarray(values, dtype=np.float64)
