"""The reference of a TOML file: every table with its keys, their types, defaults and meanings."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from types import MappingProxyType
from typing import Any

from docs.make.fields import TABLE, default_in_words, heading, rows, said_of_fields, type_in_words, types_of, words_of

Explained = Mapping[str, str]
"""The meaning of a key, by its whole name (`camera.rate_hz`)."""
_HEADER, _KEY = re.compile(r"\[([\w.]+)\]"), re.compile(r"(\w+) = (?:\"[^\"]*\"|[^#\"]|\"[^\"]*\")*?#\s*(.*)")


def tables(
    name: str, cls: type[Any], *, explained: Explained = MappingProxyType({}), leave_out: frozenset[str] = frozenset()
) -> Iterator[str]:
    """The section of a table, and after it those of the tables within; `name` is empty for the file's own keys."""
    types, said = types_of(cls), said_of_fields(cls)
    before = f"{name}." if name else ""
    specs = [spec for spec in fields(cls) if spec.name not in leave_out]
    inner = [spec.name for spec in specs if type_in_words(types[spec.name]) == TABLE]
    lines = [
        (
            f"`{spec.name}`",
            type_in_words(types[spec.name]),
            default_in_words(spec),
            said.get(spec.name) or explained.get(before + spec.name, ""),
        )
        for spec in specs
        if spec.name not in inner
    ]
    parts = [heading(3, f"[{name}]" if name else "The file's own keys"), words_of(cls)]
    yield "\n\n".join([*parts, rows(("key", "type", "default", ""), lines)] if lines else parts)
    for key in inner:
        if is_dataclass(kind := types[key]) and isinstance(kind, type) and kind.__name__ != "Table":
            yield from tables(before + key, kind, explained=explained)


def explained_in(text: str) -> Explained:
    """The comments behind the keys of a TOML file."""
    table, found = "", dict[str, str]()
    for line in text.splitlines():
        if header := _HEADER.match(line):
            table = f"{header[1]}."
        elif key := _KEY.match(line):
            found[table + key[1]] = key[2].strip()
    return found
