"""The fields of many payloads of one class at once, as arrays: all payloads are walked side by side, field by field.

A payload as our own writer packs it has its fields in the order of their numbers, each at most once. What else
protobuf allows (another order, unknown fields, a list in pieces, a text beyond ASCII) and what is damaged is not
understood here; `Fields.understood` says so, and `shared.wire.decode` is to be asked.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shared.fields import Slot, slots
from shared.messages import Message

Bytes = NDArray[np.uint8]
Integers = NDArray[np.int64]
Words = NDArray[np.uint64]
Booleans = NDArray[np.bool_]

PADDING = 512
"""Zeros that follow the bytes, so that a walk which runs over its end reads something."""
_LONGEST = 256
"""Bytes of a text or of a list of whole numbers; longer ones are not understood."""
_SCALARS = {"double": 1, "int64": 0, "bool": 0, "string": 2}
_PACKED = {"double", "int64"}
_ONE = np.uint64(1)
_HIGH, _LOW = np.uint64(0x8080808080808080), np.uint64(0x7F7F7F7F7F7F7F7F)
_FOLDS = tuple(
    (np.uint64(keep), np.uint64(move), np.uint64(shift))
    for keep, move, shift in (
        (0x007F007F007F007F, 0x7F007F007F007F00, 1),
        (0x00003FFF00003FFF, 0x3FFF00003FFF0000, 2),
        (0x000000000FFFFFFF, 0x0FFFFFFF00000000, 4),
    )
)


class Payloads(NamedTuple):
    """The offsets of n payloads: `data` (m,) with `PADDING` behind them, from `begin` (n,) to before `end` (n,)."""

    data: Bytes
    begin: Integers
    end: Integers

    def select(self, chosen: NDArray[Any]) -> Payloads:
        """Returns the payloads that are chosen (n,)."""
        return Payloads(self.data, self.begin[chosen], self.end[chosen])

    def bytes(self, number: int) -> bytes:
        """Returns the bytes of one of them."""
        return self.data[self.begin[number] : self.end[number]].tobytes()


@dataclass(frozen=True, eq=False)
class Fields:
    """Fields by name: numbers (n,), lists (n, width), texts as lists of n; of what is not `understood` (n,) anything.

    A list that is missing is nan, or 0 where it is of whole numbers.
    """

    values: Mapping[str, Any]
    understood: Booleans


def fields_of(cls: type[Message], payloads: Payloads, *, names: Mapping[str, int]) -> Fields:
    """Returns the fields of n payloads.

    Args:
        cls: their class.
        payloads: where they are.
        names: the fields that are wanted, with the length of a list (0: no list). A list that is not wanted, or is of
            another length, is not understood.
    """
    walk = _Walk(payloads)
    values = dict[str, Any]()
    for slot in sorted(slots(cls), key=lambda slot: slot.number):
        read = walk.read(slot, names.get(slot.name))
        if slot.name in names:
            values[slot.name] = read
    return Fields(values, (walk.position == payloads.end) & ~walk.void)


class _Walk:
    """One pass over all payloads: how far each has come, `position` (n,), and whether it is `void`: not understood."""

    def __init__(self, payloads: Payloads) -> None:
        self._data, self._end = payloads.data, payloads.end
        self.position = payloads.begin.copy()
        self.void = np.zeros(len(self.position), dtype=bool)
        count = len(self._data) - 8
        # Overlapping views: whatever begins at a byte is read in one go, aligned or not.
        self._words: Words = np.ndarray((count,), "<u8", buffer=self._data, strides=(1,))
        self._doubles: NDArray[np.float64] = np.ndarray((count,), "<f8", buffer=self._data, strides=(1,))

    def read(self, slot: Slot, width: int | None) -> Any:
        """Returns the field's values (None: they are not wanted), and every payload that has it moved past it."""
        if slot.nested or slot.wire_kind not in _SCALARS or (slot.repeated and slot.wire_kind not in _PACKED):
            return None  # who has such a field stays before it
        tag = _tag(slot)
        rows = self._having(tag)
        at = self.position[rows] + len(tag)
        if slot.repeated:
            return self._whole_numbers(rows, at, width) if slot.wire_kind == "int64" else self._list(rows, at, width)
        if slot.wire_kind == "string":
            return self._text(rows, at, wanted=width is not None)
        if slot.wire_kind == "double":
            self._move(rows, at + 8)
            return self._spread(rows, self._doubles[at]) if width is not None else None
        number, past = self._varint(rows, at)
        self._move(rows, past)
        if width is None:
            return None
        values = self._spread(rows, number.view(np.int64))
        return values != 0 if slot.wire_kind == "bool" else values

    def _having(self, tag: bytes) -> Any:
        """Returns the payloads in which a tag is next; a slice if all are."""
        has = (self._data[self.position] == tag[0]) & (self.position < self._end)
        for number, byte in enumerate(tag[1:], start=1):
            has &= self._data[self.position + number] == byte
        return slice(None) if has.all() else np.flatnonzero(has)

    def _spread(self, rows: Any, found: NDArray[Any]) -> NDArray[Any]:
        """Returns values of some payloads, 0 for the others."""
        if isinstance(rows, slice):
            return found
        values = np.zeros(len(self.position), dtype=found.dtype)
        values[rows] = found
        return values

    def _move(self, rows: Any, position: Integers) -> None:
        # Only ever forwards: who has come beyond its end stays there, and not so far that the next look is outside.
        self.position[rows] = np.minimum(position, self._end[rows] + 1)

    def _refuse(self, rows: Any, bad: Any) -> None:
        self.void[rows] |= bad

    def _varint(self, rows: Any, at: Integers) -> tuple[Words, Integers]:
        """Returns numbers in groups of seven bits, the lowest first, and where they end."""
        first = self._data[at]
        if len(first) and first.max() <= 0x7F:
            return first.astype(np.uint64), at + 1
        word = self._words[at]
        stops = ~word & _HIGH
        below = (stops & (~stops + _ONE)) - _ONE  # every bit before the one that ends the number
        value = word & below & _LOW
        for keep, move, shift in _FOLDS:
            value = (value & keep) | ((value & move) >> shift)
        past = at + 1 + (np.bitwise_count(below) >> 3)
        long = stops == 0
        if long.any():
            ninth, tenth = self._data[at + 8].astype(np.uint64), self._data[at + 9].astype(np.uint64)
            more = long & (ninth > 0x7F)
            value |= np.where(long, (ninth & np.uint64(0x7F)) << np.uint64(56), 0)
            value |= np.where(more, tenth << np.uint64(63), 0)
            past = past + more
            self._refuse(rows, more & (tenth > 0x7F))
        return value, past

    def _size(self, rows: Any, at: Integers) -> tuple[Integers, Integers]:
        """Returns the length of what follows, and where that begins; what is too long is refused."""
        size, at = self._varint(rows, at)
        self._refuse(rows, size > _LONGEST)
        return np.minimum(size, _LONGEST).astype(np.int64), at

    def _list(self, rows: Any, at: Integers, width: int | None) -> Any:
        size, at = self._size(rows, at)
        self._move(rows, at + size)
        if not width:
            self._refuse(rows, size > 0)
            return None
        self._refuse(rows, size != 8 * width)
        values = np.full((len(self.position), width), np.nan)
        lists = np.ndarray((len(self._data) - 8 * width, width), "<f8", buffer=self._data, strides=(1, 8))
        values[rows] = lists[at]
        return values

    def _whole_numbers(self, rows: Any, at: Integers, width: int | None) -> Any:
        size, at = self._size(rows, at)
        past = at + size
        self._move(rows, past)
        if not width:
            self._refuse(rows, size > 0)
            return None
        values = np.zeros((len(self.position), width), np.int64)
        for column in range(width):
            number, at = self._varint(rows, np.minimum(at, past))
            values[rows, column] = number.view(np.int64)
        self._refuse(rows, at != past)
        return values

    def _text(self, rows: Any, at: Integers, *, wanted: bool) -> list[str] | None:
        length, at = self._size(rows, at)
        self._move(rows, at + length)
        longest = int(length.max(initial=0))
        letters = self._data[at[:, None] + np.arange(longest)]
        letters[np.arange(longest) >= length[:, None]] = 0
        self._refuse(rows, (letters > 0x7F).any(axis=1))
        if not wanted:
            return None
        texts = [""] * len(self.position)
        known = dict[bytes, str]()
        for number, row, count in zip(np.arange(len(texts))[rows].tolist(), letters, length.tolist(), strict=True):
            raw = row[:count].tobytes()
            texts[number] = known.get(raw) or known.setdefault(raw, raw.decode("ascii", errors="replace"))
        return texts


def _tag(slot: Slot) -> bytes:
    """Returns the bytes before a field: its number and the kind of what follows, in one or two groups of seven bits."""
    number = slot.number << 3 | (2 if slot.repeated else _SCALARS[slot.wire_kind])
    return bytes([number]) if number < 0x80 else bytes([number & 0x7F | 0x80, number >> 7])
