"""A recording serves viewers: right in place and tilt, readable by ROS 2, and unseen by our own readers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as xml

import numpy as np
import pytest
from mcap.reader import make_reader

from shared.geometry import Array, matrix_from_quaternion
from shared.messages import PlatformState
from station.recording.checkup.report import examine
from station.recording.for_viewers import TOPICS
from station.recording.provenance import Provenance
from station.recording.reader import digest, open_recording
from station.recording.repair import repair
from station.recording.ros2 import NUMBER, STRING, TRANSFORMS
from station.recording.viewers.arm_links import LINKS, TILT
from station.recording.viewers.robot_description import TOPIC as DESCRIPTION
from station.recording.viewers.state import TOPIC as STATE
from station.recording.writer import Recording
from station.rig.arm_model import link_transforms, load_arm_model
from tests.unit.view import session

RIG = 'id = "test"\n[arm]\nbase_xyz_m = [0.1, 0.0, 0.2]\n'


def recorded(path: Path, *, rig: str = RIG, items: Sequence[session.Item] | None = None) -> Path:
    origin = Provenance(rig_id="test", started_ns=session.START_NS, rig_toml=rig)
    with Recording(path, provenance=origin) as file:
        for topic, message, stamp_ns in items or list(session.session_messages()):
            file.write_message(topic, message, receive_ns=stamp_ns)
    return path


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("viewers") / "session.mcap")


def told(path: Path, topic: str, type_name: str) -> list[tuple[int, Any]]:
    """Publish times and messages of a topic, decoded by rosbags."""
    stores = pytest.importorskip("rosbags.typesys", reason="the extra `ros` is not installed")
    types = stores.get_typestore(stores.Stores.ROS2_JAZZY)
    with path.open("rb") as stream:
        return [
            (message.publish_time, types.deserialize_cdr(message.data, type_name))
            for _, _, message in make_reader(stream).iter_messages(topics=["/" + topic])
        ]


def test_the_links_stand_where_the_joints_put_them(recording: Path) -> None:
    model = load_arm_model("jaco2_spherical")
    joints = {item.publish_ns: item.message for item in open_recording(recording).messages({"arm/joints"})}
    messages = told(recording, LINKS, TRANSFORMS.name)
    for stamp_ns, message in messages:
        foot, *links = message.transforms
        assert foot.header.frame_id == "world"
        assert [one.child_frame_id for one in message.transforms] == ["base", *model.joint_names]
        newest = max(time_ns for time_ns in joints if time_ns <= stamp_ns)
        last = np.linalg.multi_dot([matrix_of(one) for one in links])
        expected = link_transforms(model, joints[newest].position_rad)[-1]  # type: ignore[attr-defined]
        np.testing.assert_allclose(last, expected, atol=2e-4)


def matrix_of(stamped: Any) -> Array:
    q, at = stamped.transform.rotation, stamped.transform.translation
    matrix = np.eye(4)
    matrix[:3, :3] = matrix_from_quaternion((q.w, q.x, q.y, q.z))
    matrix[:3, 3] = at.x, at.y, at.z
    return matrix


def test_the_curve_is_the_tilt_in_degrees(recording: Path) -> None:
    curve = told(recording, TILT, NUMBER.name)
    assert len(curve) > 10
    for stamp_ns, message in curve:
        at_s = (stamp_ns - session.START_NS) * 1e-9
        # The platform is told 50 times a second, at 40 °/s on the way back.
        assert message.relative_humidity == pytest.approx(math.degrees(session.tilt_at(at_s)), abs=1.0)


def test_the_state_names_phase_and_result(recording: Path) -> None:
    states = [message.data for _, message in told(recording, STATE, STRING.name)]
    assert states[0] == "Run 1: LEVEL\n0 samples"
    assert any(text.startswith("Run 1: TILT, direction") for text in states)
    assert "slip at 24.00°" in states[-1]


def test_the_description_has_every_frame_and_is_written_once(recording: Path) -> None:
    ((_, message),) = told(recording, DESCRIPTION, STRING.name)
    robot = xml.fromstring(message.data)
    named = {link.attrib["name"] for link in robot.iter("link")}
    assert named == {"world", "base", "platform", "block", *load_arm_model("jaco2_spherical").joint_names}
    children = [child.attrib["link"] for child in robot.iter("child")]
    assert sorted(children) == sorted(named - {"world"})


def test_our_own_readers_do_not_see_it(recording: Path, tmp_path: Path) -> None:
    without = recorded(tmp_path / "without.mcap", rig="")
    reader = open_recording(recording)
    assert set(reader.topics) >= TOPICS
    assert not TOPICS & set(open_recording(without).topics)
    assert digest(reader) == digest(open_recording(without))
    assert examine(reader).unknown == ()


def test_a_repaired_recording_keeps_it(recording: Path, tmp_path: Path) -> None:
    repaired = repair(recording, out=tmp_path / "repaired.mcap").path
    assert told(repaired, DESCRIPTION, STRING.name) == told(recording, DESCRIPTION, STRING.name)


@pytest.mark.parametrize("rig", ['id = "test"\n[arm]\nmodel = "none"\n', "id = ", ""], ids=["model", "toml", "none"])
def test_a_rig_file_that_describes_no_arm_costs_no_recording(rig: str, tmp_path: Path) -> None:
    reader = open_recording(recorded(tmp_path / "session.mcap", rig=rig))
    assert not TOPICS & set(reader.topics)


def test_an_attitude_that_makes_no_sense_is_recorded_all_the_same(tmp_path: Path) -> None:
    upside = PlatformState(stamp_ns=session.START_NS, qw=0.0)
    path = recorded(tmp_path / "session.mcap", items=[("arm/platform", upside, session.START_NS)])
    assert open_recording(path).topics["arm/platform"].count == 1
