"""Payloads of every topic and service, as the bus hands them to `wire.decode`; what is decoded can be sent again."""

from __future__ import annotations

import struct
from dataclasses import fields, replace
from functools import cache, partial
from pathlib import Path
from random import Random
from typing import Any

from shared import topics, wire
from shared.errors import UserError
from shared.messages import AngleReading, Message
from tests.fuzz.change import of_bytes, of_value
from tests.fuzz.target import Target, Unclear


def messages() -> tuple[type[Message], ...]:
    """Every class that a payload on the bus may be."""
    named = [line.message for line in topics.TOPICS.values()]
    served = [kind for line in topics.SERVICES.values() for kind in (line.request, line.reply)]
    return tuple(dict.fromkeys([*named, *served, AngleReading]))


LENGTHS = (8, 9, 3, 4, 2)
"""The numbers of items that a list may want: corners, a matrix, angles, rows."""


@cache
def filled(cls: type[Message]) -> Message:
    """A message whose lists have as many items as they may, so that there is something to change."""
    message = cls()
    for spec in fields(cls):
        for length in LENGTHS if spec.type in ITEMS else ():
            longer = replace(message, **{spec.name: ITEMS[str(spec.type)] * length})
            if _possible(longer):
                message = longer
                break
    return message


ITEMS: dict[str, tuple[Any, ...]] = {"Floats": (1.5,), "Ints": (7,), "Strings": ("a",)}


def _possible(message: Message) -> bool:
    try:
        wire.decode(type(message), wire.encode(message))
    except UserError:
        return False
    return True


def changed(random: Random, message: Message) -> bytes:
    """The payload of a message with fields of other values; its bytes changed too, sometimes."""
    for _ in range(random.choice((1, 1, 2, 4))):
        spec = random.choice(fields(message))
        value = of_value(random, getattr(message, spec.name))
        try:
            message = wire_able(message, **{spec.name: value})
        except (ValueError, TypeError, ArithmeticError, struct.error):
            continue  # no sender can encode it
    payload = wire.encode(message)
    return of_bytes(random, payload) if random.random() < 0.3 else payload


def wire_able(message: Message, **values: Any) -> Message:
    """The message with other values, if they can be encoded."""
    made = replace(message, **values)
    wire.encode(made)
    return made


def _make(cls: type[Message], random: Random) -> bytes:
    if random.random() < 0.3:
        return of_bytes(random, wire.encode(filled(cls)) or b"\0")
    return changed(random, filled(cls))


def _read(cls: type[Message], path: Path) -> None:
    """A message that was accepted can be stamped, shown and sent on, and is the same then."""
    message = wire.decode(cls, path.read_bytes())
    topics.capture_ns(message)
    again = wire.decode(cls, wire.encode(message))
    if repr(again) != repr(message):
        raise Unclear(f"sent again it is another message: {again} after {message}")


TARGETS = tuple(
    Target(f"bus: {cls.__name__}", ".bin", partial(_make, cls), partial(_read, cls), share=0.6) for cls in messages()
)
