"""ROS 2 messages as rmw_zenoh puts them on the wire.

A sample: key `<domain>/<topic>/<package>::msg::dds_::<Type>_/<type hash>`, little-endian CDR as payload, and an
attachment of sequence number and source time (int64, little-endian), then the writer's id (a length byte and 16 bytes).
A node and its publishers and subscribers are liveliness tokens under `@ros2_lv`. CDR and hashes come from rosbags.
"""

from __future__ import annotations

import struct
from functools import cache
from typing import Any

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from shared.errors import UserError

JOINT_STATE = "sensor_msgs/msg/JointState"
JOINT_TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
PUBLISHED_HASHES = {
    "std_msgs/msg/String": "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    JOINT_STATE: "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
    JOINT_TRAJECTORY: "RIHS01_179b33eba59d676f6d967ac71fe35e7ca2f64b2f3928f4a018cec115e213796e",
}
RELIABLE_QOS = "::,10:,:,:,,"  # rmw_zenoh's defaults are left out: reliable, volatile; the last 10 samples kept
_PUBLISHER, _SUBSCRIBER, _NODE = "MP", "MS", "NN"


@cache
def types() -> Typestore:
    """Returns the message types of ROS 2 Jazzy."""
    return get_typestore(Stores.ROS2_JAZZY)


def message(type_name: str, **fields: Any) -> Any:
    """Returns a message of a type."""
    return types().types[type_name](**fields)


def encode(value: Any, type_name: str) -> bytes:
    """Returns a message as little-endian CDR."""
    return bytes(types().serialize_cdr(value, type_name, little_endian=True))


def decode(payload: bytes, type_name: str) -> Any:
    """Returns the message in a CDR payload.

    Raises:
        UserError: if the bytes, whoever sent them, are no such message.
    """
    try:
        return types().deserialize_cdr(payload, type_name)
    except SerdeError as error:
        raise UserError(f"Expected a {type_name}, got {len(payload)} bytes that are none ({error})") from error


def type_hash(type_name: str) -> str:
    """Returns the type's RIHS01 hash, by which publishers and subscribers match."""
    return str(types().hash_rihs01(type_name))


def dds_name(type_name: str) -> str:
    """Returns the type's name in keys: sensor_msgs/msg/JointState becomes sensor_msgs::msg::dds_::JointState_."""
    package, kind, name = type_name.split("/")
    return f"{package}::{kind}::dds_::{name}_"


def data_key(topic: str, type_name: str, *, domain: int) -> str:
    """Returns the key that samples of a topic are sent on."""
    return f"{domain}/{topic.strip('/')}/{dds_name(type_name)}/{type_hash(type_name)}"


def attachment(sequence: int, *, stamp_ns: int, writer: bytes) -> bytes:
    """Returns the attachment of a sample: 33 bytes for a writer id of 16."""
    return struct.pack("<qqB", sequence, stamp_ns, len(writer)) + writer


def node_token(session: str, *, domain: int, name: str) -> str:
    """Returns the liveliness key of a node without namespace or enclave."""
    return f"@ros2_lv/{domain}/{session}/0/0/{_NODE}/%/%/{name}"


def publisher_token(session: str, *, domain: int, node: str, entity: int, topic: str, type_name: str) -> str:
    """Returns the liveliness key of a publisher."""
    return _token(_PUBLISHER, session, domain=domain, node=node, entity=entity, topic=topic, type_name=type_name)


def subscriber_token(session: str, *, domain: int, node: str, entity: int, topic: str, type_name: str) -> str:
    """Returns the liveliness key of a subscriber."""
    return _token(_SUBSCRIBER, session, domain=domain, node=node, entity=entity, topic=topic, type_name=type_name)


def _token(kind: str, session: str, *, domain: int, node: str, entity: int, topic: str, type_name: str) -> str:
    return (
        f"@ros2_lv/{domain}/{session}/0/{entity}/{kind}/%/%/{node}/{mangled(topic)}/{dds_name(type_name)}/"
        f"{type_hash(type_name)}/{RELIABLE_QOS}"
    )


def subscribers_pattern(topic: str, type_name: str, *, domain: int) -> str:
    """Matches the tokens of all subscribers of a topic."""
    return f"@ros2_lv/{domain}/*/*/*/{_SUBSCRIBER}/*/*/*/{mangled(topic)}/{dds_name(type_name)}/*/*"


def mangled(topic: str) -> str:
    """Returns a topic's absolute name in one part of a key."""
    return "%" + topic.strip("/").replace("/", "%")
