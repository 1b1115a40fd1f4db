"""ROS 2's wire format: published hashes, and independent implementations of keys, tokens, attachment and CDR."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import pytest

from station.arm.drivers import _ros2_wire as wire

POINT = "trajectory_msgs/msg/JointTrajectoryPoint"


def trajectory() -> Any:
    duration = wire.message("builtin_interfaces/msg/Duration", sec=1, nanosec=500)
    stamp = wire.message("builtin_interfaces/msg/Time", sec=-3, nanosec=7)
    empty = np.zeros(0)
    points = [
        wire.message(
            POINT, positions=np.array([0.1, -0.2]), velocities=np.array([0.3, 4.0]), accelerations=empty, effort=empty,
            time_from_start=duration,
        )
    ] * 2  # fmt: skip
    header = wire.message("std_msgs/msg/Header", stamp=stamp, frame_id="base")
    return wire.message(wire.JOINT_TRAJECTORY, header=header, joint_names=["a", "joint_b"], points=points)


@pytest.mark.parametrize("name", sorted(wire.PUBLISHED_HASHES))
def test_type_hashes_are_the_published_ones(name: str) -> None:
    assert wire.type_hash(name) == wire.PUBLISHED_HASHES[name]


def test_the_key_has_rmw_zenoh_s_form() -> None:
    key = wire.data_key("/robot/joint_states", wire.JOINT_STATE, domain=3)
    assert key == f"3/robot/joint_states/sensor_msgs::msg::dds_::JointState_/{wire.PUBLISHED_HASHES[wire.JOINT_STATE]}"


def test_cdr_is_little_endian_and_comes_back() -> None:
    payload = wire.encode(trajectory(), wire.JOINT_TRAJECTORY)
    assert payload[:4] == b"\x00\x01\x00\x00"
    back = wire.decode(payload, wire.JOINT_TRAJECTORY)
    assert back.joint_names == ["a", "joint_b"]
    np.testing.assert_array_equal(back.points[1].velocities, [0.3, 4.0])


def test_the_attachment_has_33_bytes() -> None:
    assert wire.attachment(2, stamp_ns=-5, writer=bytes(range(16))) == (
        b"\x02" + b"\x00" * 7 + b"\xfb" + b"\xff" * 7 + b"\x10" + bytes(range(16))
    )


# --- against others' implementations ----------------------------------------------------------------------------------


def test_pycdr2_reads_and_writes_the_same_bytes() -> None:
    pytest.importorskip("pycdr2", reason="the independent CDR implementation is not installed: pip install pycdr2")
    theirs: Any = importlib.import_module("tests.unit.arm.ros2_idl")
    payload = wire.encode(trajectory(), wire.JOINT_TRAJECTORY)
    read = theirs.JointTrajectory.deserialize(payload)
    assert read.joint_names == ["a", "joint_b"]
    assert read.header.stamp.sec == -3
    assert list(read.points[0].positions) == [0.1, -0.2]
    assert read.points[1].time_from_start.nanosec == 500
    written: bytes = read.serialize()
    assert payload == written or payload.rstrip(b"\x00") == written.rstrip(b"\x00")
    again = wire.decode(written, wire.JOINT_TRAJECTORY)
    np.testing.assert_array_equal(again.points[0].velocities, [0.3, 4.0])


def sdk(module: str) -> Any:
    reason = "the independent rmw_zenoh implementation is not installed: pip install zenoh-ros2-sdk"
    return pytest.importorskip(f"zenoh_ros2_sdk.{module}", reason=reason)


def test_the_sdk_makes_the_same_keys_and_tokens() -> None:
    keys, entities, qos = sdk("keyexpr"), sdk("entity"), sdk("qos")
    name, digest = wire.dds_name(wire.JOINT_STATE), wire.type_hash(wire.JOINT_STATE)
    assert keys.topic_keyexpr(5, "/robot/joint_states", name, digest) == wire.data_key(
        "/robot/joint_states", wire.JOINT_STATE, domain=5
    )
    node = entities.NodeEntity(domain_id=5, session_id="abc", node_id=0, node_name="repose_arm")
    assert keys.node_liveliness_keyexpr(node) == wire.node_token("abc", domain=5, name="repose_arm")
    for kind, ours in (("SUBSCRIPTION", wire.subscriber_token), ("PUBLISHER", wire.publisher_token)):
        endpoint = entities.EndpointEntity(
            node=node,
            entity_id=2,
            kind=getattr(entities.EntityKind, kind),
            name="/robot/joint_states",
            dds_type_name=name,
            type_hash=digest,
            qos=qos.DEFAULT_QOS_PROFILE.encode(),
        )
        mine = ours(
            "abc", domain=5, node="repose_arm", entity=2, topic="/robot/joint_states", type_name=wire.JOINT_STATE
        )
        assert keys.endpoint_liveliness_keyexpr(endpoint) == mine


def test_the_sdk_reads_our_attachment() -> None:
    read = sdk("attachment").Attachment.from_bytes(wire.attachment(9, stamp_ns=123, writer=bytes(range(16))))
    assert (read.sequence_id, read.timestamp_ns, read.gid) == (9, 123, bytes(range(16)))


def test_the_sdk_computes_the_same_hash() -> None:
    definition = "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
    dependencies = {
        "std_msgs/msg/Header": "builtin_interfaces/Time stamp\nstring frame_id\n",
        "builtin_interfaces/msg/Time": "int32 sec\nuint32 nanosec\n",
    }
    computed = sdk("utils").get_type_hash(wire.JOINT_STATE, msg_definition=definition, dependencies=dependencies)
    assert computed == wire.type_hash(wire.JOINT_STATE)
