"""ROS 2's bag (MCAP storage, CDR), which `ros2 bag`, rosbags, PlotJuggler and Foxglove read; README.md has its topics.

The robot's description and the transforms of the arm's links are made of the recording's rig file and joints.
"""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from shared.errors import UserError
from station.recording.converters import Converted
from station.recording.converters._ros2_robot import Robot
from station.recording.reader import RecordingReader

NAME = "rosbag2"
HELP = "a bag of ROS 2: joint states, pictures, camera, transforms, robot description, samples, events and all the rest"

Item = tuple[str, str, bytes, int]
"""Topic, type, CDR and receive time (ns)."""
_LATCHED = ("/robot_description", "/tf_static")
"""Topics whose last message is meant for whoever comes later, too."""


def convert(reader: RecordingReader, out: Path) -> Converted:
    """Writes the bag as a folder `out`, whole or not at all.

    Raises:
        UserError: if it cannot be written, or the recording turns out to be damaged.
    """
    try:
        with tempfile.TemporaryDirectory(dir=out.parent, prefix=".rosbag2-") as folder:
            converted = _write(reader, Path(folder) / out.name)
            (Path(folder) / out.name).rename(out)
    except OSError as error:
        raise UserError(f"Expected to write a bag to {out}, but that failed: {error.strerror or error}") from error
    return converted


def _write(reader: RecordingReader, path: Path) -> Converted:
    from rosbags.rosbag2 import StoragePlugin, Writer  # noqa: PLC0415 - comes with the extra `ros`

    from station.recording.converters._ros2_types import Ros2Types  # noqa: PLC0415

    types, connections, left_out = Ros2Types(), dict[str, Any](), Counter[str]()
    written: dict[str, tuple[str, int]] = {}
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        for topic, type_name, payload, log_ns in _items(reader, types, left_out):
            if topic not in connections:
                qos = [_latched()] if topic in _LATCHED else []
                connections[topic] = bag.add_connection(
                    topic, type_name, typestore=types.store, offered_qos_profiles=qos
                )
            bag.write(connections[topic], log_ns, payload)
            written[topic] = (type_name, written.get(topic, ("", 0))[1] + 1)
    return Converted(written=dict(sorted(written.items())), left_out=dict(left_out))


def _items(reader: RecordingReader, types: Any, left_out: Counter[str]) -> Iterator[Item]:
    """Yields every message in order of receipt; those of the robot follow the message that they are made of."""
    from station.recording.converters._ros2_types import ros_topic  # noqa: PLC0415

    robot = Robot(reader.attachments.get("rig.toml", b"").decode("utf-8", "replace"))
    for item in reader.messages():
        made = types.encoded(item.message, item.publish_ns)
        if made is None:
            left_out[item.topic] += 1
            continue
        yield ros_topic(item.topic), *made, item.log_ns
        for topic, transforms in robot.transforms(item):
            yield topic, *types.encoded(transforms, item.publish_ns), item.log_ns
        for extra in robot.texts(item):
            yield ros_topic(extra.topic), extra.schema.name, extra.payload, item.log_ns


def _latched() -> Any:
    """Returns the quality of service of what is said once."""
    from rosbags.interfaces import (  # noqa: PLC0415
        Qos,
        QosDurability,
        QosHistory,
        QosLiveliness,
        QosReliability,
        QosTime,
    )

    forever = QosTime(9223372036, 854775807)
    return Qos(
        history=QosHistory.KEEP_LAST, depth=1, reliability=QosReliability.RELIABLE,
        durability=QosDurability.TRANSIENT_LOCAL, deadline=forever, lifespan=forever,
        liveliness=QosLiveliness.AUTOMATIC, liveliness_lease_duration=forever, avoid_ros_namespace_conventions=False,
    )  # fmt: skip
