"""The fields of a message class as they stand on the wire: number, type, repeated or not. Read once from the class."""

from __future__ import annotations

from dataclasses import Field, dataclass, fields
from functools import cache
from typing import Any, get_args, get_origin, get_type_hints

from shared.messages import Message

_SCALARS = {int: "int64", float: "double", bool: "bool", str: "string", bytes: "bytes"}


@dataclass(frozen=True, slots=True)
class Slot:
    """One field of a message class; `wire_kind` is protobuf's name of its type, or `enum:` and the enum's name."""

    name: str
    number: int
    repeated: bool
    kind: type[Any]
    wire_kind: str

    @property
    def nested(self) -> bool:
        """True if the field holds a message."""
        return issubclass(self.kind, Message)


@cache
def slots(cls: type[Message]) -> tuple[Slot, ...]:
    """Returns the fields of a class in its own order.

    The number of a field is its position, unless its metadata says other.
    """
    hints = get_type_hints(cls)
    return tuple(_slot(spec, position, hints[spec.name]) for position, spec in enumerate(fields(cls), start=1))


def _slot(spec: Field[Any], position: int, hint: Any) -> Slot:
    repeated = get_origin(hint) is tuple
    kind: type[Any] = get_args(hint)[0] if repeated else hint
    number = spec.metadata.get("number", position)
    return Slot(spec.name, number, repeated, kind, spec.metadata.get("kind") or _SCALARS.get(kind, "message"))
