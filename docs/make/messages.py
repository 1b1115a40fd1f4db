"""The reference of messages: every topic, and every message with its fields and their numbers on the wire."""

from __future__ import annotations

from dataclasses import fields
from typing import get_type_hints

from docs.make.fields import heading, rows, said_of_fields, type_in_words, words_of
from shared import topics, wire
from shared.fields import slots
from shared.messages import Message
from station.recording.for_viewers import KINDS


def page() -> str:
    """The whole page."""
    parts = [
        heading(1, "Messages"),
        "Written from `shared/topics.py` and `shared/messages.py`. On the bus a topic is the key `repose/RIG/TOPIC`, "
        "in a recording `/TOPIC`; the payload is protobuf, and each recording carries the schemas. Times (`_ns`) are "
        "nanoseconds, angles radians, lengths metres, pixels as OpenCV counts them. Fields are only ever added.",
        heading(2, "Topics"),
        _topics(),
        heading(2, "Services"),
        _services(),
        heading(2, "For viewers alone"),
        _for_viewers(),
        heading(2, "Every message"),
        *(_message(cls) for cls in _classes()),
    ]
    return "\n\n".join(parts) + "\n"


def _topics() -> str:
    header = ("topic", "message", "sent by", "Hz", "what it is")
    lines = [
        (
            f"`{line.name}`",
            _link(line.message),
            line.sender,
            f"{line.rate_hz:g}" if line.rate_hz else "on change or request",
            line.meaning,
        )
        for line in topics.TOPICS.values()
    ]
    source = topics.topic(f"{topics.ANGLE_PREFIX}SOURCE")
    return rows(header, [*lines, (f"`{source.name}`", _link(source.message), source.sender, "", source.meaning)])


def _services() -> str:
    lines = [
        (f"`{line.name}`", _link(line.request), _link(line.reply), line.server, line.asker, line.meaning)
        for line in topics.SERVICES.values()
    ]
    return rows(("service", "question", "answer", "answered by", "asked by", "what for"), lines)


def _for_viewers() -> str:
    told = ", ".join(f"`/{topic}`" for kind in KINDS for topic in sorted(kind.topics))
    return f"A recording also holds {told} (station/recording/README.md); no program of this repository reads them."


def _classes() -> list[type[Message]]:
    """Every message that a topic or a service names, and those inside of them."""
    named = [line.message for line in topics.TOPICS.values()] + [topics.topic(f"{topics.ANGLE_PREFIX}SOURCE").message]
    named += [kind for line in topics.SERVICES.values() for kind in (line.request, line.reply)]
    found = dict[type[Message], None]()
    while named:
        cls = named.pop(0)
        found[cls] = None
        named += [slot.kind for slot in slots(cls) if slot.nested and slot.kind not in found]
    return sorted(found, key=wire.schema_name)


def _link(cls: type[Message]) -> str:
    return f"[`{wire.schema_name(cls)}`](#{_anchor(cls)})"


def _anchor(cls: type[Message]) -> str:
    return wire.schema_name(cls).replace(".", "").lower()


def _message(cls: type[Message]) -> str:
    said, hints = said_of_fields(cls), get_type_hints(cls)
    lines = [
        (str(slot.number), f"`{spec.name}`", type_in_words(hints[spec.name]), said.get(spec.name, ""))
        for spec, slot in zip(fields(cls), slots(cls), strict=True)
    ]
    return "\n\n".join([heading(3, wire.schema_name(cls)), words_of(cls), rows(("number", "field", "type", ""), lines)])
