"""Every message class: through the wire and back, its numbers frozen, its schema readable by others."""

import importlib
import math
from dataclasses import fields
from functools import cache
from typing import Any, get_args, get_origin, get_type_hints

import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from hypothesis import given
from hypothesis import strategies as st

from shared import foxglove, topics, wire
from shared import messages as m
from shared.errors import UserError
from shared.messages import Message

RECORDED = {line.message for line in topics.TOPICS.values()}
ASKED = {kind for service in topics.SERVICES.values() for kind in (service.request, service.reply)}
CLASSES = sorted(RECORDED | ASKED, key=lambda cls: cls.__name__)
OURS = [cls for cls in CLASSES if cls.PACKAGE == "repose"]
THEIRS = [cls for cls in CLASSES if cls.PACKAGE == "foxglove"]

INTEGERS = st.integers(-(2**63), 2**63 - 1)
VALUES: dict[Any, st.SearchStrategy[Any]] = {
    int: INTEGERS,
    float: st.floats(),
    bool: st.booleans(),
    str: st.text(max_size=20),
    bytes: st.binary(max_size=20),
}


def messages(cls: type[Message]) -> st.SearchStrategy[Message]:
    return st.builds(cls, **{spec.name: values(get_type_hints(cls)[spec.name], spec.metadata) for spec in fields(cls)})


def values(hint: Any, metadata: Any) -> st.SearchStrategy[Any]:
    if get_origin(hint) is tuple:
        return st.lists(values(get_args(hint)[0], {}), max_size=9).map(tuple)
    kind = metadata.get("kind", "")
    if kind == "fixed32":
        return st.integers(0, 2**32 - 1)
    if kind == "int32":
        return st.integers(-(2**31), 2**31 - 1)
    if kind.startswith("enum:"):
        return st.integers(0, len(foxglove.ENUMS[kind.removeprefix("enum:")]) - 1)
    return VALUES[hint] if hint in VALUES else messages(hint)


def same(one: Any, other: Any) -> bool:
    """Equal, with NaN equal to itself."""
    if isinstance(one, float) and isinstance(other, float):
        return one == other or (math.isnan(one) and math.isnan(other))
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, Message):
        return type(one) is type(other) and all(
            same(getattr(one, spec.name), getattr(other, spec.name)) for spec in fields(one)
        )
    return one == other


@cache
def strangers(cls: type[Message]) -> Any:
    """The class that protobuf itself makes of the schema."""
    files = descriptor_pb2.FileDescriptorSet.FromString(wire.schema(cls))
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(wire.schema_name(cls)))


@pytest.mark.parametrize("cls", CLASSES, ids=lambda cls: cls.__name__)
@given(data=st.data())
def test_what_is_sent_arrives_and_is_written_as_by_protobuf(cls: type[Message], data: st.DataObject):
    message = data.draw(messages(cls))
    payload = wire.encode(message)
    assert payload == wire.encode(message)
    assert strangers(cls).FromString(payload).SerializeToString() == payload
    if message.impossible() or not payload:
        with pytest.raises(UserError, match=f"Expected a {wire.schema_name(cls)}, got "):
            wire.decode(cls, payload)
    else:
        assert same(message, wire.decode(cls, payload))


@pytest.mark.parametrize("cls", CLASSES, ids=lambda cls: cls.__name__)
def test_a_stranger_can_read_it_with_the_schema_alone(cls: type[Message]):
    assert strangers(cls).FromString(wire.encode(cls())) is not None


def test_zeros_and_the_largest_numbers_are_written_as_protobuf_does():
    for number in (0, 1, 127, 128, 2**56 - 1, 2**56, 1_600_000_000_123_456_789, 2**63 - 1, -1, -(2**63)):
        for message in (
            m.PlatformState(number, 0.0, -0.0, 1.0, math.nan, 5e-324, px=-0.0),
            m.MarkerCorners(number, -number % 2**63, (0.0, -0.0), corner_dt_ns=(number, 0), found=number == 1),
        ):
            payload = wire.encode(message)
            read = strangers(type(message)).FromString(payload)
            assert read.SerializeToString() == payload
            assert (read.capture_ns if isinstance(message, m.MarkerCorners) else read.stamp_ns) == number


def test_a_number_that_does_not_fit_is_refused():
    with pytest.raises(ValueError, match="out of range"):
        wire.encode(m.PlatformState(stamp_ns=2**63))


@pytest.mark.parametrize("cls", CLASSES, ids=lambda cls: cls.__name__)
@given(payload=st.binary(max_size=40))
def test_garbage_is_refused_in_one_sentence_or_is_a_message(cls: type[Message], payload: bytes):
    try:
        message: Message | None = wire.decode(cls, payload)
    except UserError as error:
        message, said = None, str(error)
    else:
        said = ""
    assert isinstance(message, cls) or wire.schema_name(cls) in said


@pytest.mark.parametrize("cls", OURS, ids=lambda cls: cls.__name__)
def test_fields_are_only_ever_added_at_the_end(cls: type[Message]):
    """The numbers of a class are its fields' positions, so the beginning of this list may never change."""
    frozen = FROZEN.get(cls.__name__, "").split()
    assert frozen, f"add {cls.__name__} to FROZEN"
    assert [spec.name for spec in fields(cls)][: len(frozen)] == frozen


@pytest.mark.parametrize("cls", [*THEIRS, foxglove.FrameTransform, foxglove.Pose], ids=lambda cls: cls.__name__)
def test_foxglove_schemas_are_the_published_ones(cls: type[Message]):
    name = cls.__name__
    published = getattr(importlib.import_module(f"foxglove_schemas_protobuf.{name}_pb2"), name).DESCRIPTOR
    files = descriptor_pb2.FileDescriptorSet.FromString(wire.schema(cls))
    (own,) = [message for file in files.file for message in file.message_type if message.name == name]
    theirs = {field.name: (field.number, field.type, field.is_repeated) for field in published.fields}
    repeated = descriptor_pb2.FieldDescriptorProto.LABEL_REPEATED
    ours = {field.name: (field.number, field.type, field.label == repeated) for field in own.field}
    assert ours == {key: value for key, value in theirs.items() if key in ours}
    assert set(ours) >= {key for key in theirs if key in ours}
    assert len(ours) == len(theirs)


@pytest.mark.parametrize("line", topics.TOPICS.values(), ids=lambda line: line.name)
def test_every_message_knows_when_it_happened(line: topics.Topic):
    assert isinstance(topics.capture_ns(line.message()), int)


def test_classes_that_may_block_do_not_share_a_priority_with_those_that_drop():
    classes = {line.traffic for line in topics.TOPICS.values()} | {s.traffic for s in topics.SERVICES.values()}
    blocking = {traffic.priority for traffic in classes if not traffic.drop}
    assert blocking.isdisjoint(traffic.priority for traffic in classes if traffic.drop)


def test_an_unknown_topic_is_named():
    with pytest.raises(UserError, match="'camera/cornrs'"):
        topics.topic("camera/cornrs")
    assert topics.topic("angle/imu").message.__name__ == "AngleReading"


FROZEN = {
    "MarkerCorners": "capture_ns seq corners_px sigma_px residual_px exposure_ns corner_dt_ns found reason marker_id"
    " boot_id tipped noiseless",
    "BlockPose": "stamp_ns seq x y z qw qx qy qz sigma_m sigma_rad found reason",
    "PlatformState": "stamp_ns qw qx qy qz wx wy wz px py pz frame_id",
    "JointState": "stamp_ns name position_rad velocity_rad_s effort_nm",
    "TiltCommand": "stamp_ns run direction azimuth_rad angle_rad step rate_rad_s owner",
    "RunEvent": "stamp_ns run phase reason step",
    "Sample": "run start_ns slip_ns detect_ns euler_rad reference_corners_px corner_variance_px2 post_corners_px"
    " direction azimuth_rad dwell_s tilt_rate_rad_s onset_angle_rad onset_sigma_rad flags plate_mount_rad"
    " block_mass_kg block_area_m2 object plate temperature_c relative_humidity censored previous_direction rest_ns"
    " step_from_rad step_to_rad start_x_m start_y_m start_yaw_rad",
    "Environment": "stamp_ns temperature_c relative_humidity",
    "ClockOffset": "stamp_ns agent offset_ns sigma_ns rtt_ns",
    "AgentStatus": "stamp_ns frames dropped queue exposure_ns gain temperature_c cpu_percent version fault rate_hz"
    " boot_id",
    "ArmReply": "accepted reason stamp_ns run step passing",
    "ArmStop": "stamp_ns reason",
    "MotionReport": "stamp_ns run step begin_ns end_ns fault passing",
    "Heartbeat": "stamp_ns armed owner",
    "LeaseRequest": "stamp_ns owner take_over",
    "ArmLease": "stamp_ns owner stopped",
    "ClockPing": "station_ns",
    "ClockPong": "station_ns agent_ns",
    "FrameRequest": "from_ns to_ns",
    "FrameReply": "frames reason",
    "JointTarget": "stamp_ns position_rad velocity_rad_s",
    "TwinScene": "stamp_ns qw qx qy qz px py pz block_x_m block_y_m block_z_m block_qw block_qx block_qy block_qz mu",
    "CameraGeometry": "stamp_ns plate_from_pixel mm_per_px marker_side_m marker_aspect mark_height_m camera_x_m"
    " camera_y_m camera_height_m corner_sigma_px source",
    "SessionPause": "stamp_ns paused",
    "SessionStatus": "stamp_ns owner recording samples total paused slip_base_px slip_per_deg_px slip_corners"
    " started_ns",
    "SessionRequest": "stamp_ns action",
    "SessionReply": "accepted reason",
}
