"""A message for viewers, the form of the kinds that make them, and what several kinds need."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar, Protocol

from shared import wire
from shared.messages import Message
from shared.rig import RigConfig
from station.recording import ros2
from station.rig.placed_arm import PlacedArm

DRAWN_HZ = 10.0
"""The rate at which moving things are written that no transform moves: as fast as the camera's preview."""
_FINE = 2.0**16


@dataclass(frozen=True, slots=True)
class Schema:
    """A message type as MCAP wants it: its name, its definition, and how that and the messages are encoded."""

    name: str
    definition: bytes
    encoding: str
    message_encoding: str


@dataclass(frozen=True, slots=True)
class Extra:
    """A message for viewers: its topic, its schema and its bytes."""

    topic: str
    schema: Schema
    payload: bytes


Handler = Callable[[Any, int], Iterable[Extra]]
"""Takes a recorded message and the time at which it happened (ns); gives what viewers get with it."""


class Kind(Protocol):
    """A kind of message for viewers: `topics` are those that it writes."""

    topics: ClassVar[frozenset[str]]

    def __init__(self, rig: RigConfig, arm: PlacedArm, /) -> None:
        """Begins a session with this rig."""
        ...

    def handlers(self) -> Mapping[str, Handler]:
        """Returns the recorded topics that it is made of, each with the function that takes its messages."""
        ...


@cache
def ros(kind: ros2.Type) -> Schema:
    """Returns the schema of a ROS 2 message."""
    return Schema(kind.name, kind.definition.encode(), ros2.SCHEMA_ENCODING, ros2.MESSAGE_ENCODING)


@cache
def _protobuf(cls: type[Message]) -> Schema:
    return Schema(wire.schema_name(cls), wire.schema(cls), "protobuf", "protobuf")


def foxglove(topic: str, message: Message) -> Extra:
    """Returns a Foxglove message for viewers."""
    return Extra(topic, _protobuf(type(message)), wire.encode(message))


def coarse(number: float) -> float:
    """Returns a number in steps of 1 / 65536, finer than any picture, which packs tighter than a measured one."""
    return round(number * _FINE) / _FINE


class Pace:
    """Says when something that comes faster than `DRAWN_HZ` is to be written."""

    def __init__(self) -> None:
        self._next_ns = 0

    def due(self, stamp_ns: int) -> bool:
        """Returns true if the last time it was written is long enough ago."""
        return stamp_ns >= self._next_ns

    def written(self, stamp_ns: int) -> None:
        """Notes that it was written now."""
        self._next_ns = stamp_ns + int(1e9 / DRAWN_HZ)
