"""The topics of a recording and its messages, as its readers hand them out.

Topics are named as on the bus (`camera/corners`), without the slash that they have in the file.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

from mcap.summary import Summary

from shared import topics, wire
from shared.bus import Received
from shared.errors import UserError
from shared.messages import AngleReading, Message
from station.recording.chunks import RawMessage
from station.recording.for_viewers import TOPICS as FOR_VIEWERS

M = TypeVar("M", bound=Message)
TRUTH = "truth/"
LATEST_NS = 2**63 - 1
"""The year 2262: what is stamped later is no message. The format has a bit more than any clock or reader."""
_CLASSES = {wire.schema_name(line.message): line.message for line in topics.TOPICS.values()} | {
    wire.schema_name(AngleReading): AngleReading
}


@dataclass(frozen=True, slots=True)
class TopicInfo:
    """A topic of a recording; `message` is None when this version does not know the schema."""

    name: str
    schema: str
    message: type[Message] | None
    count: int


class Recorded:
    """A message as it was recorded. `publish_ns`: when it happened; `log_ns`: when the station received it."""

    __slots__ = ("log_ns", "message", "payload", "publish_ns", "topic")

    def __init__(self, topic: str, *, payload: bytes, message: Message, publish_ns: int, log_ns: int) -> None:
        self.topic = topic
        self.payload = payload
        self.message = message
        self.publish_ns = publish_ns
        self.log_ns = log_ns

    @property
    def received(self) -> Received:
        """The message as it came over the bus: what a replay hands to the live pipeline."""
        return Received(self.topic, self.log_ns, self.message, payload=self.payload)


def topics_of(summary: Summary) -> dict[int, TopicInfo]:
    """Returns the topics that an index names, by the numbers of their channels."""
    counts = summary.statistics.channel_message_counts if summary.statistics is not None else {}
    found = dict[int, TopicInfo]()
    for number, channel in summary.channels.items():
        schema = summary.schemas[channel.schema_id].name if channel.schema_id in summary.schemas else ""
        name = channel.topic.removeprefix("/")
        found[number] = TopicInfo(name, schema, class_of(name, schema), counts.get(number, 0))
    return found


def class_of(topic: str, schema: str) -> type[Message] | None:
    """Returns the class of a topic's messages.

    It is None if the schema is unknown, not that of this topic, or for viewers alone.
    """
    if topic in FOR_VIEWERS:
        return None
    found = _CLASSES.get(schema)
    return None if topics.known(topic) and topics.topic(topic).message is not found else found


def message_of(cls: type[M], raw: RawMessage) -> M | None:
    """Returns the message as it stands in the file.

    It is None if it is none of this class, or has a time that no message has.
    """
    if max(raw.log_ns, raw.publish_ns) > LATEST_NS:
        return None
    try:
        return wire.decode(cls, raw.payload)
    except UserError:
        return None
