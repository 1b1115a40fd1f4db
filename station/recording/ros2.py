"""The few ROS 2 messages that a recording holds for viewers: their definitions, and their bytes (little-endian CDR).

Rerun draws a robot's description, a curve and a text from no protobuf message. rosbags knows these types too, but a
station without ROS goes without it; a test holds both equal. CDR aligns each number to its own size, counted from
behind the four bytes that say how the rest is encoded (OMG DDS-XTypes 1.3, section 7.4.3).
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass

SCHEMA_ENCODING = "ros2msg"
MESSAGE_ENCODING = "cdr"
_LITTLE_ENDIAN = b"\x00\x01\x00\x00"
_RULE = "=" * 80
_TIME = f"{_RULE}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
_HEADER = f"{_RULE}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n{_TIME}"
_VECTOR = f"{_RULE}\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
_QUATERNION = f"{_RULE}\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"


@dataclass(frozen=True)
class Type:
    """A message type: its name, and its definition with those of the types that it is made of."""

    name: str
    definition: str


STRING = Type("std_msgs/msg/String", "string data\n")
UNREAD_STRING = Type(
    STRING.name, "# The definition of std_msgs/msg/String, a comment so that viewers show no text: string data\n"
)
"""A string that is not for reading: Rerun would show a robot's description as a page of XML, too."""
NUMBER = Type(
    "sensor_msgs/msg/RelativeHumidity",
    f"std_msgs/Header header\nfloat64 relative_humidity\nfloat64 variance\n{_HEADER}",
)
"""A stamped number. ROS 2 has none without a meaning, and of those that Rerun draws this one alone has no unit."""
TRANSFORMS = Type(
    "tf2_msgs/msg/TFMessage",
    "geometry_msgs/TransformStamped[] transforms\n"
    f"{_RULE}\nMSG: geometry_msgs/TransformStamped\n"
    "std_msgs/Header header\nstring child_frame_id\nTransform transform\n"
    f"{_RULE}\nMSG: geometry_msgs/Transform\nVector3 translation\nQuaternion rotation\n"
    f"{_VECTOR}{_QUATERNION}{_HEADER}",
)

Transform = tuple[str, str, Sequence[float], Sequence[float]]
"""Parent, child, translation x, y, z (m), rotation w, x, y, z: parent_from_child."""


def string(text: str) -> bytes:
    """Returns a `STRING`."""
    body = bytearray()
    _add_string(body, text)
    return bytes(_LITTLE_ENDIAN + body)


def number(value: float, *, stamp_ns: int) -> bytes:
    """Returns a `NUMBER`; its variance is 0, which ROS calls unknown."""
    body = bytearray()
    _add_header(body, stamp_ns, frame="")
    _align(body, 8)
    return bytes(_LITTLE_ENDIAN + body + _TWO.pack(value, 0.0))


def transforms(items: Sequence[Transform], *, stamp_ns: int) -> bytes:
    """Returns a `TRANSFORMS`: all of one moment."""
    body = bytearray(_LENGTH.pack(len(items)))
    for parent, child, xyz_m, (w, x, y, z) in items:
        _add_header(body, stamp_ns, frame=parent)
        _add_string(body, child)
        _align(body, 8)
        body += _POSE.pack(*xyz_m, x, y, z, w)
    return bytes(_LITTLE_ENDIAN + body)


_STAMP, _LENGTH, _TWO, _POSE = (struct.Struct(form) for form in ("<iI", "<I", "<2d", "<7d"))


def _add_header(body: bytearray, stamp_ns: int, *, frame: str) -> None:
    _align(body, 4)
    body += _STAMP.pack(*divmod(stamp_ns, 1_000_000_000))
    _add_string(body, frame)


def _add_string(body: bytearray, text: str) -> None:
    data = text.encode() + b"\0"
    _align(body, 4)
    body += _LENGTH.pack(len(data))
    body += data


def _align(body: bytearray, size: int) -> None:
    body += bytes(-len(body) % size)
