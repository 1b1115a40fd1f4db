"""Many messages of one kind as protobuf at once: every field is written, so that all are of one length.

Protobuf writes a number as a varint, whose length depends on it; a varint may be padded to any length up to ten bytes
with continuation bits, which every parser reads. So a stream of a hundred thousand messages is one array of bytes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Doubles = NDArray[np.float64]
Integers = NDArray[np.int64]
_STAMP_BYTES, _SMALL_BYTES = 9, 4
_VARINT, _DOUBLE, _LENGTH = 0, 1, 2


class Packer:
    """Collects the fields of `count` messages, in the order in which they are added."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._parts: list[Bytes] = []

    def stamp(self, field: int, values: Integers) -> Packer:
        """An int64 of nanoseconds since 1970."""
        return self._varint(field, values, _STAMP_BYTES)

    def small(self, field: int, values: Integers | int) -> Packer:
        """An int64 below 2²⁸."""
        return self._varint(field, np.broadcast_to(np.asarray(values, np.int64), self._count), _SMALL_BYTES)

    def flag(self, field: int, value: bool) -> Packer:
        """A bool that all share."""
        return self._same(bytes([field << 3 | _VARINT, int(value)]))

    def double(self, field: int, values: Doubles | float) -> Packer:
        """A double."""
        rows = np.broadcast_to(np.asarray(values, np.float64), self._count)
        self._tag(field, _DOUBLE)
        self._parts.append(np.ascontiguousarray(rows).view(np.uint8).reshape(self._count, 8))
        return self

    def doubles(self, field: int, values: Doubles) -> Packer:
        """A packed list of doubles, (count, n)."""
        size = 8 * values.shape[1]
        self._same(bytes([field << 3 | _LENGTH]) + _varint_of(size))
        self._parts.append(np.ascontiguousarray(values, np.float64).view(np.uint8).reshape(self._count, size))
        return self

    def text(self, field: int, value: str) -> Packer:
        """A string that all share."""
        data = value.encode()
        return self._same(bytes([field << 3 | _LENGTH]) + _varint_of(len(data)) + data)

    def raw(self, field: int, data: bytes) -> Packer:
        """A packed list that all share, already encoded."""
        return self._same(bytes([field << 3 | _LENGTH]) + _varint_of(len(data)) + data)

    def rows(self) -> Bytes:
        """The messages, (count, length)."""
        return np.concatenate(self._parts, axis=1) if self._parts else np.zeros((self._count, 0), np.uint8)

    def _tag(self, field: int, kind: int) -> None:
        if not 0 < field < 16:
            raise ValueError(f"expected a field number from 1 to 15, whose tag takes one byte, got {field}")
        self._same(bytes([field << 3 | kind]))

    def _same(self, data: bytes) -> Packer:
        self._parts.append(np.broadcast_to(np.frombuffer(data, np.uint8), (self._count, len(data))))
        return self

    def _varint(self, field: int, values: Integers, size: int) -> Packer:
        if len(values) and (values.min() < 0 or int(values.max()) >> (7 * size)):
            raise ValueError(f"expected numbers from 0 to 2^{7 * size} for field {field}")
        self._tag(field, _VARINT)
        shifts = 7 * np.arange(size, dtype=np.int64)
        parts = ((values[:, None] >> shifts) & 0x7F).astype(np.uint8)
        parts[:, :-1] |= 0x80
        self._parts.append(parts)
        return self


def _varint_of(value: int) -> bytes:
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)
