"""Foxglove shows a recording in the published schemas, right in place, and laid out by topics that exist."""

import importlib
import json
import math
import tomllib
from collections import Counter
from collections.abc import Iterator
from functools import reduce
from importlib.resources import files
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as xml

import numpy as np
import pytest
from google.protobuf import descriptor_pb2
from mcap.reader import make_reader

from shared import foxglove_annotations, foxglove_joints, foxglove_scene, wire
from shared.config import Table
from shared.foxglove import FoxgloveMessage
from shared.geometry import matrix_from_quaternion
from shared.messages import JointState, MarkerCorners
from shared.rig import RigConfig, rig_of_table
from station.recording.reader import open_recording
from station.recording.viewers import annotations, joint_states, log, scene
from station.rig.arm_model import load_arm_model
from station.rig.description import description
from station.rig.placed_arm import PlacedArm, placed_arm
from tests.unit.recording.test_for_viewers import RIG, recorded
from tests.unit.view import session

DRAWN = [
    cls
    for module in (foxglove_annotations, foxglove_joints, foxglove_scene)
    for cls in vars(module).values()
    if isinstance(cls, type) and issubclass(cls, FoxgloveMessage) and cls.__module__ == module.__name__
]
LAYOUT: dict[str, Any] = json.loads(files("station.view").joinpath("foxglove_layout.json").read_text("utf-8"))


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("foxglove") / "session.mcap")


def published(name: str) -> Any:
    """A message class of the package that Foxglove publishes."""
    modules = pytest.importorskip("foxglove_schemas_protobuf", reason="foxglove-schemas-protobuf is not installed")
    return getattr(importlib.import_module(f"{modules.__name__}.{name}_pb2"), name)


def told(path: Path, topic: str) -> list[tuple[int, Any]]:
    """Publish times and messages of a topic, read by the published class; its bytes hold nothing else."""
    found = list[tuple[int, Any]]()
    with path.open("rb") as stream:
        for schema, _, message in make_reader(stream).iter_messages(topics=["/" + topic]):
            assert schema is not None
            package, _, name = schema.name.partition(".")
            assert package == "foxglove"
            theirs = published(name).FromString(message.data)
            assert theirs.SerializeToString() == message.data
            found.append((message.publish_time, theirs))
    return found


@pytest.mark.parametrize("cls", DRAWN, ids=lambda cls: cls.__name__)
def test_the_schemas_agree_with_the_published_ones(cls: type[FoxgloveMessage]) -> None:
    theirs = published(cls.__name__).DESCRIPTOR
    files_of = descriptor_pb2.FileDescriptorSet.FromString(wire.schema(cls))
    (own,) = [message for file in files_of.file for message in file.message_type if message.name == cls.__name__]
    repeated = descriptor_pb2.FieldDescriptorProto.LABEL_REPEATED
    for field in own.field:
        like = theirs.fields_by_name[field.name]
        kind = like.message_type or like.enum_type
        assert (field.number, field.type, field.label == repeated) == (like.number, like.type, like.is_repeated)
        assert field.type_name == (f".{kind.full_name}" if kind else "")
    for enum in own.enum_type:
        values = {value.name: value.number for value in enum.value}
        assert values == {value.name: value.number for value in theirs.enum_types_by_name[enum.name].values}


def test_the_annotations_are_the_corners_half_a_pixel_on(recording: Path) -> None:
    seen = {item.publish_ns: item.message for item in open_recording(recording).messages({"camera/corners"})}
    drawn = told(recording, annotations.TOPIC)
    assert len(drawn) > 10
    assert {message.texts[0].text for _, message in drawn} >= {"Run 1: LEVEL", "Run 1: SLIP, direction 0 (azimuth 0°)"}
    for stamp_ns, message in drawn:
        corners = seen[stamp_ns]
        assert isinstance(corners, MarkerCorners)
        (mark,) = message.points
        assert mark.type == mark.LINE_LOOP
        points = [value for point in mark.points for value in (point.x, point.y)]
        np.testing.assert_allclose(points, np.add(corners.corners_px, 0.5), atol=1e-4)


def test_no_two_annotations_are_closer_than_a_tenth_of_a_second(recording: Path) -> None:
    times_ns = [stamp_ns for stamp_ns, _ in told(recording, annotations.TOPIC)]
    assert np.diff(times_ns).min() >= 100_000_000


def test_a_lost_mark_is_said_and_no_longer_drawn(tmp_path: Path) -> None:
    stamps = [session.START_NS + k * 200_000_000 for k in range(2)]
    found = MarkerCorners(stamps[0], corners_px=(1.0, 1.0, 9.0, 1.0, 9.0, 9.0, 1.0, 9.0), found=True)
    lost = MarkerCorners(stamps[1], reason="it is dark")
    items = [("camera/corners", message, message.capture_ns) for message in (found, lost)]
    (_, first), (_, second) = told(recorded(tmp_path / "lost.mcap", items=items), annotations.TOPIC)
    assert len(first.points) == 1
    assert not first.texts
    assert not second.points
    assert second.texts[0].text == "no mark: it is dark"


def test_the_scene_is_the_robot_that_the_urdf_describes(recording: Path) -> None:
    ((_, update),) = told(recording, scene.TOPIC)
    entities = {entity.id: entity for entity in update.entities}
    assert set(entities) == {"base", "platform", "block", *load_arm_model("jaco2_spherical").joint_names}
    assert all(entity.frame_locked and entity.frame_id == name for name, entity in entities.items())
    block = entities["block"].cubes[0].size
    urdf = xml.fromstring(description(*_rig()))
    assert {shape.tag for each in urdf.iter("geometry") for shape in each} == {"box", "cylinder", "sphere"}
    (link,) = [link for link in urdf.iter("link") if link.attrib["name"] == "block"]
    size = next(link.iter("box")).attrib["size"]
    assert [block.x, block.y, block.z] == [float(word) for word in size.split()]


def test_a_capsule_goes_from_one_end_of_its_link_to_the_other(recording: Path) -> None:
    ((_, update),) = told(recording, scene.TOPIC)
    model = load_arm_model("jaco2_spherical")
    link = model.joints[1]
    (entity,) = [entity for entity in update.entities if entity.id == link.name]
    ends = [[ball.pose.position.x, ball.pose.position.y, ball.pose.position.z] for ball in entity.spheres]
    np.testing.assert_allclose(ends, [link.link_capsule.from_m, link.link_capsule.to_m], atol=1e-5)
    (rod,) = entity.cylinders
    assert rod.size.z == pytest.approx(math.dist(*ends))
    q = rod.pose.orientation
    along = matrix_from_quaternion((q.w, q.x, q.y, q.z))[:, 2] * rod.size.z
    np.testing.assert_allclose(along, np.subtract(ends[1], ends[0]), atol=1e-5)


def _rig() -> tuple[RigConfig, PlacedArm]:
    rig = rig_of_table(Table(tomllib.loads(RIG)))
    return rig, placed_arm(rig)


def test_the_joints_are_those_that_were_measured(recording: Path) -> None:
    measured = {item.publish_ns: item.message for item in open_recording(recording).messages({"arm/joints"})}
    states = told(recording, joint_states.TOPIC)
    assert len(states) > 10
    for stamp_ns, message in states:
        joints = measured[stamp_ns]
        assert isinstance(joints, JointState)
        assert [joint.name for joint in message.joints] == list(joints.name)
        assert all(joint.HasField("position") and not joint.HasField("velocity") for joint in message.joints)
        np.testing.assert_allclose([joint.position for joint in message.joints], joints.position_rad, atol=1e-5)


def test_a_joint_at_zero_has_a_position(tmp_path: Path) -> None:
    still = JointState(session.START_NS, ("one",), (0.0,))
    path = recorded(tmp_path / "zero.mcap", items=[("arm/joints", still, session.START_NS)])
    ((_, message),) = told(path, joint_states.TOPIC)
    assert message.joints[0].HasField("position")
    assert message.joints[0].position == 0.0


def test_the_log_has_every_phase_and_the_result(recording: Path) -> None:
    lines = [message.message for _, message in told(recording, log.TOPIC)]
    assert [line for line in lines if "slip" not in line] == [f"run 1: {phase}" for _, phase in session.PHASES]
    assert any("run 1: slip at 24.00°" in line for line in lines)


def strings(value: Any) -> Iterator[str]:
    """Every text of a layout: names as well as values."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield key
            yield from strings(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from strings(inner)


def test_the_layout_names_topics_and_fields_that_a_recording_has(recording: Path) -> None:
    paths = {text for text in strings(LAYOUT) if text.startswith("/")}
    schemas = dict[str, tuple[str, bytes]]()
    with recording.open("rb") as stream:
        for schema, channel, _ in make_reader(stream).iter_messages():
            assert schema is not None
            schemas[channel.topic] = schema.name, schema.data
    assert len(paths) > 8
    for path in paths:
        topic, *inner = path.replace("[:]", "").split(".")
        assert topic in schemas, f"{path} is not in a recording"
        name, definition = schemas[topic]
        for field in inner:
            assert field.encode() in definition, f"{name} of {path} has no {field}"


def test_the_layout_shows_each_of_its_panels_once() -> None:
    assert LAYOUT.keys() == {"configById", "globalVariables", "userNodes", "playbackConfig", "layout"}
    panels = Counter(text for text in strings(LAYOUT["layout"]) if "!" in text)
    assert panels == Counter(LAYOUT["configById"].keys())
    shown = reduce(set.union, (set(strings(config)) for config in LAYOUT["configById"].values()), set[str]())
    assert {text.partition(".")[0] for text in shown} >= {
        "/" + kind.TOPIC for kind in (annotations, scene, joint_states, log)
    }
