"""Changes to bytes, numbers, texts and tables, as damage, mistakes and malice make them."""

from __future__ import annotations

import json
import math
import re
import struct
from collections.abc import Callable
from copy import deepcopy
from random import Random
from typing import Any, cast

INTEGERS = (
    0,
    1,
    -1,
    2,
    7,
    127,
    128,
    255,
    256,
    65535,
    65536,
    2**31 - 1,
    2**31,
    2**32,
    2**53,
    2**63 - 1,
    2**63,
    -(2**63),
)
NUMBERS = (0.0, -0.0, 1e-320, 1e-9, -1.0, 0.5, 1.0, 1e9, 1e19, 1e200, 1.7e308, math.inf, -math.inf, math.nan)
TEXTS = (
    "",
    " ",
    "\0",
    "[/red]",
    "[bold]x",
    "{0}",
    "%s",
    "\x1b[2J",
    "../../etc/passwd",
    "a" * 3000,
    "ä€😀",
    "\ud800",
    "=1+1",
    "\n",
    "NaN",
    "/truth/scene",
)
ANY: tuple[Any, ...] = (*INTEGERS, 10**400, *NUMBERS, *TEXTS, True, False, [], {}, [[]], [0.0], [1, "x"], {"a": 1})
_WORD = re.compile(rb"[-+]?\d[\d._eE+-]*|[A-Za-z_]\w*")
_WRITTEN = (b"0", b"-1", b"1e999", b"-1e308", b"nan", b"inf", b"1e-320", b"9" * 400, b"9223372036854775808", b'""')
_WRITTEN_TOO = (b"true", b"[]", b"{}", b'"[/red]"', b"'\x1b[2J'", b"[[", b"\xff", b"\0", b"x", b"", b"1979-05-27", b"_")


def of_bytes(random: Random, data: bytes) -> bytes:
    """A few bytes flipped, set, blanked, cut, doubled, or a number of some width written over them."""
    changed = bytearray(data)
    for _ in range(_few(random)):
        if not changed:
            break
        random.choice(_BYTE_CHANGES)(random, changed)
    return bytes(changed)


def _flip(random: Random, data: bytearray) -> None:
    data[random.randrange(len(data))] ^= 1 << random.randrange(8)


def _set(random: Random, data: bytearray) -> None:
    data[random.randrange(len(data))] = random.choice((0, 1, 127, 128, 255, random.randrange(256)))


def _blank(random: Random, data: bytearray) -> None:
    """Zeros from a sector's begin on, as a disk leaves them after a power cut."""
    size = random.choice((16, 128, 512, 4096))
    begin = random.randrange(len(data)) // size * size
    length = min(size * random.choice((1, 1, 8)), len(data) - begin)
    data[begin : begin + length] = bytes(length)


def _cut(random: Random, data: bytearray) -> None:
    begin = random.randrange(len(data))
    del data[begin : begin + random.choice((1, 2, 8, random.randrange(1, len(data) + 1)))]


def _double(random: Random, data: bytearray) -> None:
    begin = random.randrange(len(data))
    part = data[begin : begin + random.choice((1, 8, 64))]
    data[begin:begin] = part * random.choice((1, 2, 50))


def _overwrite(random: Random, data: bytearray) -> None:
    kind = random.choice("BHIQ")
    value = random.choice(INTEGERS) % 2 ** (8 * struct.calcsize(kind))
    begin = random.randrange(len(data))
    data[begin : begin + struct.calcsize(kind)] = struct.pack("<" + kind, value)


def _end(random: Random, data: bytearray) -> None:
    del data[random.randrange(len(data)) :]


_BYTE_CHANGES: tuple[Callable[[Random, bytearray], None], ...] = (
    _flip,
    _flip,
    _set,
    _blank,
    _cut,
    _double,
    _overwrite,
    _end,
)


def of_text(random: Random, data: bytes) -> bytes:
    """Words and numbers of a text replaced, lines left out, doubled and swapped; now and then mere bytes."""
    if random.random() < 0.15:
        return of_bytes(random, data)
    for _ in range(_few(random)):
        if random.random() < 0.75:
            words = [*_WORD.finditer(data)]
            if words:
                word = random.choice(words)
                new = random.choice((*_WRITTEN, *_WRITTEN_TOO, random.choice(words)[0]))
                if word[0][:1].isdigit() and random.random() < 0.7:  # a number that parses, so that it gets further
                    new = random.choice((b"0", b"1", b"3", b"100000", b"1e9", b"1e300", b"0.5", b"1e-12", b"7.0"))
                data = data[: word.start()] + new + data[word.end() :]
        else:
            lines = data.split(b"\n")
            here, there = random.randrange(len(lines)), random.randrange(len(lines))
            if random.random() < 0.5:
                lines.insert(here, lines[there])
            else:
                lines[here], lines[there] = lines[there], lines[here]
            data = b"\n".join(lines)
    return data


def of_table(random: Random, table: Any) -> Any:
    """A copy of nested tables and lists with a few values replaced, left out, renamed or wrapped."""
    table = json.loads(json.dumps(table))
    for _ in range(_few(random)):
        holder, key = random.choice([*places(table)] or [({}, "")])
        what = random.random()
        if what < 0.5:
            holder[key] = of_value(random, holder.get(key) if isinstance(holder, dict) else holder[key])
        elif what < 0.7:
            holder[key] = deepcopy(random.choice(ANY))  # its content is changed later on, and `ANY` must not be
        elif what < 0.8:
            holder[key] = [holder.get(key) if isinstance(holder, dict) else holder[key]]
        elif isinstance(holder, dict):
            holder[random.choice(TEXTS)] = holder.pop(key, None)
        else:
            holder.append(holder[key])
    return table


def places(value: Any) -> list[tuple[Any, Any]]:
    """Returns the places of values in nested tables and lists, however deep they are, the outer places first."""
    found, holders, known = list[tuple[Any, Any]](), [value], {id(value)}
    for holder in holders:
        keys = [*cast(dict[Any, Any], holder)] if isinstance(holder, dict) else [*range(len(holder))]
        found += [(holder, key) for key in keys]
        inner = {id(holder[key]): holder[key] for key in keys if isinstance(holder[key], dict | list)}
        holders += [each for name, each in inner.items() if name not in known]
        known.update(inner)
    return found


def of_value(random: Random, value: Any) -> Any:
    """Another value of about the same kind: what a field of a message may be set to."""
    if isinstance(value, tuple):
        return _of_tuple(random, list(cast(tuple[Any, ...], value)))
    others: dict[type, Callable[[], Any]] = {
        bool: lambda: not value,
        int: lambda: random.choice((*INTEGERS, value + 1, value - 1, -value)),
        float: lambda: random.choice(
            (*NUMBERS, -value, value * 1e6, *(value * random.uniform(0.5, 2) for _ in "abcd"))
        ),
        str: lambda: random.choice(TEXTS),
        bytes: lambda: of_bytes(random, value),
    }
    return others.get(type(value), lambda: value)()


def _of_tuple(random: Random, items: list[Any]) -> tuple[Any, ...]:
    if items and random.random() < 0.6:
        place = random.randrange(len(items))
        items[place] = of_value(random, items[place])
        return tuple(items)
    return tuple(items[: random.randrange(len(items) + 1)]) * random.choice((0, 1, 2))


def _few(random: Random) -> int:
    """One mostly, sometimes many."""
    return random.choice((1, 1, 1, 2, 3, random.randrange(1, 30)))
