"""Protobuf bytes straight from a message: for each class a function of its own, written once from its fields.

The protobuf library spends most of its time on filling an object by name that is read once. The functions made here
give the same bytes, which a test holds them to for every message; they are what recording is fast by. As proto3 wants
it, a scalar that is zero is left out, and fields follow each other by number.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from functools import cache, lru_cache
from itertools import groupby
from operator import attrgetter
from typing import Any

from shared.fields import Slot, slots
from shared.messages import Message

Packer = Callable[[Any], bytes]
_VARINT, _FIXED64, _LENGTH, _FIXED32 = 0, 1, 2, 5
_WIRE_TYPES = {"double": _FIXED64, "fixed32": _FIXED32, "string": _LENGTH, "bytes": _LENGTH, "message": _LENGTH}
_ZERO = bytes(8)
_DOUBLE = struct.Struct("<d").pack
_UINT32 = struct.Struct("<I").pack


@cache
def packer(cls: type[Message]) -> Packer:
    """The function that turns a message of this class into its protobuf bytes."""
    ordered = sorted(slots(cls), key=lambda slot: slot.number)
    source = _Source()
    parts = [part for group in _groups(ordered) for part in source.parts(group)]
    names = "".join(f"{slot.name}, " for slot in ordered)
    read = attrgetter(*(slot.name for slot in ordered)) if len(ordered) > 1 else _alone(ordered[0].name)
    body = f"    {names}= _read(message)\n    return _join(({''.join(f'{part}, ' for part in parts)}))"
    scope: dict[str, Any] = {**source.scope, "_read": read, "_join": b"".join}
    exec(compile(f"def pack(message):\n{body}", f"<packer of {cls.__name__}>", "exec"), scope)
    return scope["pack"]


def _alone(name: str) -> Callable[[Any], tuple[Any]]:
    read = attrgetter(name)
    return lambda message: (read(message),)


def _groups(ordered: list[Slot]) -> Iterator[list[Slot]]:
    """Neighbouring numbers with a fraction together, because one call packs them all; everything else by itself."""
    for doubles, group in groupby(ordered, key=lambda slot: slot.wire_kind == "double" and not slot.repeated):
        if doubles:
            yield list(group)
        else:
            yield from ([slot] for slot in group)


class _Source:
    """Collects what the text of a function refers to; `parts` gives the expressions of one group of fields.

    Names in it begin with an underscore, which no field's does.
    """

    def __init__(self) -> None:
        self.scope: dict[str, Any] = {
            "_varint": varint,
            "_number": number,
            "_text": text,
            "_texts": _texts,
            "_size": _size,
            "_doubles": _doubles,
            "_integers": _integers,
        }

    def parts(self, group: list[Slot]) -> list[str]:
        """Expressions that are bytes, in order."""
        slot = group[0]
        if slot.wire_kind == "double" and not slot.repeated:
            return [self._doubles(group)]
        if slot.repeated:
            return [self._repeated(slot)]
        return [self._single(slot)]

    def _name(self, value: Any, *, prefix: str) -> str:
        name = f"_{prefix}{len(self.scope)}"
        self.scope[name] = value
        return name

    def _doubles(self, group: list[Slot]) -> str:
        """Packs all fractions at once while none is zero."""
        tags = [_tag(slot) for slot in group]
        dense = self._name(struct.Struct("<" + "".join(f"{len(tag)}sd" for tag in tags)).pack, prefix="dense")
        sparse = self._name(_sparse(tags), prefix="sparse")
        names = ", ".join(slot.name for slot in group)
        tagged = ", ".join(f"{tag!r}, {slot.name}" for tag, slot in zip(tags, group, strict=True))
        return f"({dense}({tagged}) if {names.replace(', ', ' and ')} else {sparse}({names}))"

    def _single(self, slot: Slot) -> str:
        tag, name = _tag(slot), slot.name
        if slot.nested:
            return f"{tag!r} + _varint(len(part := {self._name(packer(slot.kind), prefix='pack')}({name}))) + part"
        value = {
            "string": f"_text({name})",
            "bytes": f"_size({name})",
            "bool": "b'\\x01'",
            "fixed32": f"{self._name(_UINT32, prefix='fixed')}({name})",
            "int64": f"_number({name})",
        }.get(slot.wire_kind, f"_varint({name})")
        return f"({tag!r} + {value} if {name} else b'')"

    def _repeated(self, slot: Slot) -> str:
        tag, name = _tag(slot), slot.name
        if slot.nested:
            pack = self._name(packer(slot.kind), prefix="pack")
            return f"_join([{tag!r} + _size({pack}(item)) for item in {name}])"
        if slot.wire_kind == "string":
            return f"_texts({tag!r}, {name})"
        numbers = "_doubles" if slot.wire_kind == "double" else "_integers"
        return f"({tag!r} + {numbers}({name}) if {name} else b'')"


def _tag(slot: Slot) -> bytes:
    kind = _LENGTH if slot.repeated else _WIRE_TYPES.get(slot.wire_kind, _VARINT)
    return varint(slot.number << 3 | kind)


@lru_cache(maxsize=4096)
def varint(number: int) -> bytes:
    """A whole number in groups of seven bits, the lowest first; a negative one as its two's complement in 64 bits.

    Raises:
        ValueError: if it does not fit into 64 bits.
    """
    if not -(1 << 63) <= number < 1 << 63:
        raise ValueError(f"expected a number of 64 bits, got {number}")
    number &= (1 << 64) - 1
    groups = bytearray()
    while number > 0x7F:
        groups.append(number & 0x7F | 0x80)
        number >>= 7
    groups.append(number)
    return bytes(groups)


@cache
def _pairs() -> list[bytes]:
    """The two bytes of every group of fourteen bits that others follow."""
    return [bytes((value & 0x7F | 0x80, value >> 7 | 0x80)) for value in range(1 << 14)]


def number(value: int) -> bytes:
    """Packs a whole number as `varint` does, but faster for stamps, whose upper bits rarely change."""
    if not 1 << 28 <= value < 1 << 63:
        return varint(value)
    pairs = _pairs()
    return pairs[value & 0x3FFF] + pairs[value >> 14 & 0x3FFF] + varint(value >> 28)


@lru_cache(maxsize=1024)
def text(value: str) -> bytes:
    """A text with its length before it."""
    return _size(value.encode())


@lru_cache(maxsize=256)
def _texts(tag: bytes, values: tuple[str, ...]) -> bytes:
    return b"".join([tag + text(value) for value in values])


def _size(payload: bytes) -> bytes:
    return varint(len(payload)) + payload


def _sparse(tags: list[bytes]) -> Callable[..., bytes]:
    """Packs fractions of which some are zero; minus zero is not."""

    def pack(*values: float) -> bytes:
        pairs = zip(tags, values, strict=True)
        return b"".join([tag + _DOUBLE(value) for tag, value in pairs if value or _DOUBLE(value) != _ZERO])

    return pack


@cache
def _many(count: int) -> tuple[bytes, Callable[..., bytes]]:
    return varint(8 * count), struct.Struct(f"<{count}d").pack


def _doubles(values: tuple[float, ...]) -> bytes:
    size, pack = _many(len(values))
    return size + pack(*values)


@lru_cache(maxsize=256)
def _integers(values: tuple[int, ...]) -> bytes:
    return _size(b"".join(map(varint, values)))
