"""A bag that rosbags reads back has every message of the recording, with its numbers and its stamps."""

from __future__ import annotations

import itertools
from collections import Counter
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="the extra `ros` is not installed")

from rosbags.interfaces import QosDurability
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from shared import foxglove, topics
from shared.fields import slots
from shared.messages import AngleReading, JointState, MarkerCorners, Message, RunEvent, Sample
from station.__main__ import main as station
from station.recording.converters import Converted, converters
from station.recording.converters._ros2_types import Ros2Types, ros_topic
from station.recording.provenance import Provenance
from station.recording.reader import Recorded, open_recording
from station.recording.writer import Recording
from station.rig.arm_model import link_transforms, load_arm_model
from tests.unit.view import session

RIG = 'id = "test"\n[arm]\nbase_xyz_m = [0.1, 0.0, 0.2]\n'
OFFSET_NS = 1_234_567
EXTRA: list[tuple[str, Message]] = [
    ("log", foxglove.Log(foxglove.Timestamp.from_ns(session.START_NS + 7), 3, "too dark", "camera")),
    ("angle/mocap-1", AngleReading(stamp_ns=session.START_NS + 8, angle_rad=0.3)),
]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rosbag2") / "session.mcap"
    origin = Provenance(rig_id="test", started_ns=session.START_NS, rig_toml=RIG)
    with Recording(path, provenance=origin) as file:
        for topic, message, stamp_ns in session.session_messages():
            file.write_message(topic, message, receive_ns=stamp_ns + OFFSET_NS)
        for topic, message in EXTRA:
            file.write_message(topic, message, receive_ns=session.START_NS + 60_000_000_000)
    return path


@pytest.fixture(scope="module")
def bag(recording: Path) -> Path:
    return recording.with_name("bag")


@pytest.fixture(scope="module")
def converted(recording: Path, bag: Path) -> Converted:
    return converters()["rosbag2"].convert(open_recording(recording), bag)


@pytest.fixture(scope="module")
def told(bag: Path, converted: Converted) -> dict[str, list[tuple[int, Any]]]:
    """Receive times and messages by topic, decoded by what the bag says of itself alone."""
    found: dict[str, list[tuple[int, Any]]] = {}
    store = get_typestore(Stores.ROS2_JAZZY)
    with Reader(bag) as reader:
        for connection in reader.connections:
            if connection.msgtype.startswith("repose_msgs/"):
                store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
        for connection, log_ns, data in reader.messages():
            message = store.deserialize_cdr(data, connection.msgtype)
            found.setdefault(connection.topic, []).append((log_ns, message))
    return found


def ours(recording: Path, topic: str) -> list[Recorded]:
    return list(open_recording(recording).messages({topic}))


def stamp_ns(header: Any) -> int:
    return header.stamp.sec * 1_000_000_000 + header.stamp.nanosec


def test_every_message_is_there_or_said_to_be_left_out(
    recording: Path, told: dict[str, list[tuple[int, Any]]], converted: Converted
) -> None:
    counts = Counter(item.topic for item in open_recording(recording).messages())
    said = {topic: count for topic, (_, count) in converted.written.items()}
    assert counts.keys() >= {"arm/joints", "camera/corners", "session/sample", "log", "tf", "angle/mocap-1"}
    for topic, count in counts.items():
        if topic == "camera/image/overlay":
            assert converted.left_out == {topic: count}
        elif topic != "tf":
            assert said[ros_topic(topic)] == count == len(told[ros_topic(topic)])
    assert said["/tf"] == len(told["/tf"])


def test_joints_pictures_and_camera_keep_numbers_and_stamps(
    recording: Path, told: dict[str, list[tuple[int, Any]]]
) -> None:
    for item, (log_ns, made) in zip(ours(recording, "arm/joints"), told["/joint_states"], strict=True):
        assert isinstance(item.message, JointState)
        assert (log_ns, stamp_ns(made.header)) == (item.log_ns, item.publish_ns)
        assert (tuple(made.name), tuple(made.position)) == (item.message.name, item.message.position_rad)
        assert tuple(made.velocity) == item.message.velocity_rad_s
    for item, (_, made) in zip(ours(recording, "camera/image"), told["/camera/image/compressed"], strict=True):
        assert isinstance(item.message, foxglove.CompressedImage)
        assert (made.data.tobytes(), made.format) == (item.message.data, item.message.format)
        assert (stamp_ns(made.header), made.header.frame_id) == (item.publish_ns, item.message.frame_id)
    for item, (_, made) in zip(ours(recording, "camera/calibration"), told["/camera/camera_info"], strict=True):
        assert isinstance(item.message, foxglove.CameraCalibration)
        assert (made.width, made.height) == (item.message.width, item.message.height)
        np.testing.assert_array_equal(made.k, item.message.K)


@pytest.mark.parametrize(
    ("topic", "cls"), [("session/sample", Sample), ("session/event", RunEvent), ("camera/corners", MarkerCorners)]
)
def test_our_own_types_have_our_fields(
    topic: str, cls: type[Message], recording: Path, told: dict[str, list[tuple[int, Any]]]
) -> None:
    for item, (log_ns, made) in zip(ours(recording, topic), told[f"/{topic}"], strict=True):
        assert log_ns == item.log_ns
        for slot in slots(cls):
            found, wanted = getattr(made, slot.name), getattr(item.message, slot.name)
            assert (tuple(found) if slot.repeated else found) == wanted


def test_the_arm_stands_in_tf_where_its_joints_put_it(recording: Path, told: dict[str, list[tuple[int, Any]]]) -> None:
    model = load_arm_model("jaco2_spherical")
    ((_, foot),) = told["/tf_static"]
    at = foot.transforms[0].transform.translation
    assert (foot.transforms[0].child_frame_id, at.x, at.y, at.z) == ("base", 0.1, 0.0, 0.2)
    links = [made for _, made in told["/tf"] if made.transforms[0].header.frame_id == "base"]
    own = [made for _, made in told["/tf"] if made.transforms[0].header.frame_id != "base"]
    assert [stamp_ns(made.transforms[0].header) for made in own] == [item.publish_ns for item in ours(recording, "tf")]
    joints = ours(recording, "arm/joints")
    for made in links[:: len(links) // 5]:
        assert [one.child_frame_id for one in made.transforms] == list(model.joint_names)
        when_ns = stamp_ns(made.transforms[0].header)
        newest = max((item for item in joints if item.publish_ns <= when_ns), key=lambda item: item.publish_ns)
        assert isinstance(newest.message, JointState)
        wanted = link_transforms(model, newest.message.position_rad)[0, :3, 3]
        found = made.transforms[0].transform.translation
        np.testing.assert_allclose((found.x, found.y, found.z), wanted, atol=1e-9)


def test_the_description_is_for_whoever_comes_later(bag: Path, told: dict[str, list[tuple[int, Any]]]) -> None:
    ((_, description),) = told["/robot_description"]
    assert description.data.startswith("<")
    assert "<robot" in description.data
    with Reader(bag) as reader:
        found = {connection.topic: cast(Any, connection.ext).offered_qos_profiles for connection in reader.connections}
    for topic in ("/robot_description", "/tf_static"):
        assert [qos.durability for qos in found[topic]] == [QosDurability.TRANSIENT_LOCAL]


def test_a_log_line_goes_where_ros_2_has_them(told: dict[str, list[tuple[int, Any]]]) -> None:
    (line,) = [made for _, made in told["/rosout"] if made.msg == "too dark"]
    assert (line.level, line.name, line.stamp.nanosec % 1_000_000_000) == (30, "camera", (session.START_NS + 7) % 10**9)


def test_every_message_on_the_bus_has_a_type() -> None:
    types = Ros2Types()
    for topic in topics.TOPICS.values():
        made = types.encoded(topic.message(), 5)
        assert (made is None) == (topic.message is foxglove.PointCloud), topic.name


def test_a_recording_without_a_rig_file_is_converted_too(tmp_path: Path) -> None:
    path, out = tmp_path / "a.mcap", tmp_path / "bag"
    with Recording(path, provenance=Provenance(rig_id="test", started_ns=session.START_NS)) as file:
        for topic, message, stamp in itertools.islice(session.session_messages(), 300):
            file.write_message(topic, message, receive_ns=stamp)
    converted = converters()["rosbag2"].convert(open_recording(path), out)
    assert "/joint_states" in converted.written
    assert "/robot_description" not in converted.written


def test_what_is_there_is_not_written_over_and_a_damaged_file_leaves_nothing(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "there").mkdir()
    assert station(["convert", str(recording), "--to", "rosbag2", "--out", str(tmp_path / "there")]) == 2
    assert "is there; give another --out" in capsys.readouterr().err
    assert station(["convert", str(recording), "--to", "rosbag2", "--out", str(tmp_path / "no" / "where")]) == 2
    assert "Expected to write a bag" in capsys.readouterr().err
    damaged = tmp_path / "damaged.mcap"
    data = bytearray(recording.read_bytes())
    data[len(data) // 3] ^= 0xFF
    damaged.write_bytes(data)
    assert station(["convert", str(damaged), "--to", "rosbag2"]) == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["damaged.mcap", "there"]


def test_every_converter_has_a_line() -> None:
    assert all(converter.HELP for converter in converters().values())


def test_the_command_prints_the_counts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.mcap"
    with Recording(path, provenance=Provenance(rig_id="test", started_ns=session.START_NS)) as file:
        for number in range(3):
            message = RunEvent(stamp_ns=session.START_NS + number, run=1, phase="LEVEL")
            file.write_message("session/event", message, receive_ns=session.START_NS + number)
    assert station(["convert", str(path), "--to", "rosbag2"]) == 0
    said = capsys.readouterr().out
    assert "3  /session/event" in said
    assert f"{tmp_path / 'a-rosbag2'}: 3 messages" in said
