"""Dataclass to protobuf and back: the payload on the bus and the schema in a recording, both derived from the class.

There are no .proto files. A class becomes a protobuf descriptor at first use; the number of a field is its position
in the class, unless its metadata says otherwise (`shared.foxglove`).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar

from google.protobuf import descriptor_pb2, descriptor_pool, duration_pb2, message_factory, timestamp_pb2

from shared.errors import UserError
from shared.fields import Slot, slots
from shared.foxglove import ENUMS, Duration, Timestamp
from shared.messages import Message
from shared.visible import shortened

M = TypeVar("M", bound=Message)
_Proto = descriptor_pb2.FieldDescriptorProto
_GOOGLES: dict[type[Message], Any] = {Timestamp: timestamp_pb2.DESCRIPTOR, Duration: duration_pb2.DESCRIPTOR}
"""The classes whose descriptors protobuf brings along."""
_POOL = descriptor_pool.DescriptorPool()
for _descriptor in _GOOGLES.values():
    _POOL.AddSerializedFile(_descriptor.serialized_pb)


def schema_name(cls: type[Message]) -> str:
    """Returns the protobuf full name, e.g. `repose.MarkerCorners`."""
    return f"{cls.PACKAGE}.{cls.__name__}"


def _file_name(cls: type[Message]) -> str:
    if cls in _GOOGLES:
        return _GOOGLES[cls].name
    return schema_name(cls).replace(".", "/") + ".proto"


def _nested(cls: type[Message]) -> list[type[Message]]:
    return list(dict.fromkeys(slot.kind for slot in slots(cls) if slot.nested))


def _file_descriptor(cls: type[Message]) -> descriptor_pb2.FileDescriptorProto:
    file = descriptor_pb2.FileDescriptorProto(name=_file_name(cls), package=cls.PACKAGE, syntax="proto3")
    file.dependency.extend(_file_name(kind) for kind in _nested(cls))
    message = file.message_type.add(name=cls.__name__)
    for slot in slots(cls):
        _describe(slot, message, schema_name(cls))
    return file


def _describe(slot: Slot, message: descriptor_pb2.DescriptorProto, owner: str) -> None:
    label = _Proto.LABEL_REPEATED if slot.repeated else _Proto.LABEL_OPTIONAL
    spec = message.field.add(name=slot.name, number=slot.number, label=label)
    if slot.nested:
        spec.type, spec.type_name = _Proto.TYPE_MESSAGE, "." + schema_name(slot.kind)
    elif slot.wire_kind.startswith("enum:"):
        name = slot.wire_kind.removeprefix("enum:")
        enum = message.enum_type.add(name=name.rpartition(".")[2])
        for number, value in enumerate(ENUMS[name]):
            enum.value.add(name=value, number=number)
        spec.type, spec.type_name = _Proto.TYPE_ENUM, f".{owner}.{enum.name}"
    else:
        spec.type = getattr(_Proto, "TYPE_" + slot.wire_kind.upper())


@cache
def _proto_class(cls: type[Message]) -> Any:
    if cls not in _GOOGLES:
        for kind in _nested(cls):
            _proto_class(kind)
        _POOL.Add(_file_descriptor(cls))
    return message_factory.GetMessageClass(_POOL.FindMessageTypeByName(schema_name(cls)))


@cache
def schema(cls: type[Message]) -> bytes:
    """Returns the serialized FileDescriptorSet of a message and of all that it contains, as MCAP wants it."""
    files: dict[str, descriptor_pb2.FileDescriptorProto] = {}
    _collect_files(cls, files)
    return descriptor_pb2.FileDescriptorSet(file=list(files.values())).SerializeToString(deterministic=True)


def _collect_files(cls: type[Message], files: dict[str, descriptor_pb2.FileDescriptorProto]) -> None:
    for kind in _nested(cls):
        _collect_files(kind, files)
    if cls in _GOOGLES:
        file = descriptor_pb2.FileDescriptorProto.FromString(_GOOGLES[cls].serialized_pb)
        files.setdefault(file.name, file)
    else:
        files.setdefault(_file_name(cls), _file_descriptor(cls))


def encode(message: Message) -> bytes:
    """Returns the protobuf payload of a message; the same message gives the same bytes."""
    return _encoder(type(message))(message)


@cache
def _encoder(cls: type[Message]) -> Callable[[Any], bytes]:
    """Fills protobuf's class by one call that names every field; to gather them by name first takes 1.6 times as long.

    `tests/benchmarks/test_recording_speed.py` measures both.
    """
    text = f"lambda message: _made({_named(cls, 'message')}).SerializeToString()"
    encoder: Callable[[Any], bytes] = eval(text, {"_made": _proto_class(cls)})
    return encoder


def _named(cls: type[Message], owner: str) -> str:
    """Returns the fields of a class as keywords of a call, read from the variable `owner`; what is nested is a dict."""
    return ", ".join(f"{slot.name}={_read(slot, owner)}" for slot in slots(cls))


def _read(slot: Slot, owner: str) -> str:
    value = f"{owner}.{slot.name}"
    if not slot.nested:
        return value
    if slot.repeated:
        return f"[dict({_named(slot.kind, f'{owner}_')}) for {owner}_ in {value}]"
    return f"dict({_named(slot.kind, value)})"


def decode(cls: type[M], payload: bytes, *, may_be_empty: bool = False) -> M:
    """Returns the message in a payload, its texts `shortened`: whoever shows or quotes them need not expect long ones.

    The payload, which is what is recorded, stays as it was sent. Without a single byte it parses, too, and would be a
    message of 1970 with all fields at zero. `may_be_empty` is for questions and answers, some of which have no fields
    to fill in: an emergency stop needs none.

    Raises:
        UserError: if the payload is empty, is not a protobuf of this class, or holds what none can
            (`Message.impossible`).
    """
    if not (payload or may_be_empty):
        raise UserError(f"Expected a {schema_name(cls)}, got an empty payload; fill in its fields, the time among them")
    try:
        message = _from_proto(cls, _proto_class(cls).FromString(payload))
    except Exception as error:
        raise UserError(
            f"Expected a {schema_name(cls)} of {len(payload)} bytes, got something that does not parse ({error}); "
            "is every process of the same version?"
        ) from error
    if wrong := message.impossible():
        raise UserError(f"Expected a {schema_name(cls)}, got {wrong}")
    return message


def _from_proto(cls: type[M], proto: Any) -> M:
    values: dict[str, Any] = {}
    for slot in slots(cls):
        value = getattr(proto, slot.name)
        if slot.nested:
            value = (
                tuple(_from_proto(slot.kind, item) for item in value)
                if slot.repeated
                else _from_proto(slot.kind, value)
            )
        elif slot.kind is str:
            value = map(shortened, value) if slot.repeated else shortened(value)
        values[slot.name] = tuple(value) if slot.repeated else value
    return cls(**values)
