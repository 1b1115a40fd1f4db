"""TOML files into frozen dataclasses, strictly: an unknown or wrongly typed key is named with its file and line."""

from __future__ import annotations

import json
import re
import tomllib
import types
from collections.abc import Iterable
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from shared.arguments import nearest
from shared.errors import UserError

T = TypeVar("T")
_NAME = re.compile(r"\w+")
_LARGE = 2**63
"""TOML's own limit for an integer, which Python's reader does not enforce."""
_MOST_LETTERS = 1_000_000
"""A rig file has some thousand letters, a table of deviations some 100 000; Python's objects take ten times as much."""
_MOST_LEVELS = 32
"""A rig file has four levels; Python gives up at a thousand calls, of which each level takes a few."""


@dataclass(frozen=True)
class Table:
    """A table of a TOML file that still knows where it stands, so that whoever reads it can point at a line.

    A dataclass field of this type keeps its table unread: the plug-in that it configures parses it. `own` is True for a
    file of the user's own, which may name other files; what came in a recording may not.
    """

    values: dict[str, Any]
    file: str = "(built in)"
    text: str = ""
    path: tuple[str, ...] = ()
    own: bool = False

    def error(self, key: str, expected: str, got: str) -> UserError:
        """Returns the error that names file, line and key."""
        line = _line_of(self.text, (*self.path, key))
        where = f"{self.file}, line {line}" if line else self.file
        name = ".".join((*self.path, key))
        return UserError(f"{where}: expected {expected} for '{name}', got {got}")

    def child(self, key: str) -> Table:
        """Returns the table under `key` (empty if there is none)."""
        value = self.values.get(key, {})
        if not isinstance(value, dict):
            raise self.error(key, "a table", repr(value))
        return Table(value, self.file, self.text, (*self.path, key), self.own)  # pyright: ignore[reportUnknownArgumentType]


def table_of(text: str | bytes, where: str) -> Table:
    """Returns the table in a TOML text; `where` names it in errors. A stranger may have written it.

    Raises:
        UserError: if it is not TOML, or so long or so deep that no file of a person is.
    """
    try:
        _require_short(text)
        words = text if isinstance(text, str) else text.decode("utf-8")
        return Table(_shallow(tomllib.loads(words)), where, words)
    except (ValueError, RecursionError) as error:  # a wrong TOML, letter or number is a ValueError
        raise UserError(f"{where}: expected TOML, got something else: {error}") from error


def json_table(text: str, where: str) -> Table:
    """Returns the object in a JSON text as a table; `where` names it in errors. A stranger may have written it.

    Raises:
        UserError: if it is not JSON, no object, or so long or so deep that no program of ours writes it.
    """
    try:
        _require_short(text)
        found: Any = json.loads(text)
        if not isinstance(found, dict):
            raise ValueError("it is no object")
        return Table(_shallow(cast(dict[str, Any], found)), where, text)
    except (ValueError, RecursionError) as error:
        raise UserError(f"{where}: expected a JSON object, got something else: {error}") from error


def _require_short(text: str | bytes) -> None:
    if len(text) > _MOST_LETTERS:
        raise ValueError(f"it has more than {_MOST_LETTERS} letters")


def _shallow(values: dict[str, Any]) -> dict[str, Any]:
    """Returns the values, unless they are nested so deeply that those who read them would recurse without end.

    Raises:
        ValueError: if they are.
    """
    level: list[Any] = [values]
    for _ in range(_MOST_LEVELS):
        inner = (each.values() if isinstance(each, dict) else each for each in level)
        level = [one for each in inner for one in cast(Iterable[Any], each) if isinstance(one, dict | list)]
    if level:
        raise ValueError(f"it is nested deeper than {_MOST_LEVELS} levels")
    return values


def load_table(path: Path) -> Table:
    """Reads a TOML file.

    Raises:
        UserError: if the file is missing or not TOML.
    """
    try:
        with path.open(encoding="utf-8") as file:
            return replace(table_of(file.read(_MOST_LETTERS + 1), str(path)), own=True)
    except OSError as error:
        raise UserError(f"Expected a TOML file at {path}, but it cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise UserError(f"{path}: expected TOML, got something else: {error}") from error


def own_folders(table: Table, key: str, names: Iterable[str]) -> tuple[Path, ...]:
    """Returns the folders that a key of the user's own file names, relative to that file.

    Raises:
        UserError: for folders that no file on disk names, such as those of a rig inside a recording: a stranger wrote
            it, and what is loaded from them is run.
    """
    named, file = tuple(names), Path(table.file)
    if named and not file.is_file():
        raise table.error(key, f"no folders outside a rig file on disk, from which alone {key} are loaded", str(named))
    return tuple(file.parent / Path(name).expanduser() for name in named)


def require_own_file(table: Table, key: str) -> None:
    """Refuses a key that names a file instead of one of Repose's own by its name, unless the table is the user's own.

    Raises:
        UserError: for the rig inside a recording, whose writer would choose which files are opened here.
    """
    name = table.values.get(key)
    if isinstance(name, str) and not _NAME.fullmatch(name) and not table.own:
        raise table.error(
            key, "a name that comes with Repose, as only a rig file on disk may name a file,", f"'{name}'"
        )


def parse(cls: type[T], table: Table) -> T:
    """Fills the dataclass `cls` from a table; absent keys keep their defaults, tables nest.

    A field whose metadata says `secret` is not shown when it is wrong.

    Raises:
        UserError: for an unknown key, a wrong type, a missing key without default, or a value that `cls` refuses
            (a ValueError from its `__post_init__`).
    """
    specs: dict[str, Field[Any]] = {spec.name: spec for spec in fields(cls)}  # pyright: ignore[reportArgumentType]
    for key in table.values:
        if key not in specs:
            raise table.error(key, f"one of {', '.join(sorted(specs))}", f"an unknown key{nearest(key, specs)}")
    hints = get_type_hints(cls)
    values: dict[str, Any] = {}
    for name, spec in specs.items():
        if name in table.values:
            values[name] = _convert(hints[name], table, name, secret=bool(spec.metadata.get("secret")))
        elif spec.default is MISSING and spec.default_factory is MISSING:
            raise table.error(name, _describe(hints[name]), "nothing: the key is missing")
    try:
        return cls(**values)
    except ValueError as error:
        where = f"[{'.'.join(table.path)}]" if table.path else "top level"
        raise UserError(f"{table.file}, {where}: {error}") from error


def _convert(hint: Any, table: Table, key: str, *, secret: bool) -> Any:
    value = table.values[key]
    if hint is Table:
        return table.child(key)
    if is_dataclass(hint):
        return parse(hint, table.child(key))  # pyright: ignore[reportArgumentType]
    if (converted := _as(hint, value)) is not None:
        return converted
    raise table.error(key, _describe(hint), "something else, which is not shown" if secret else f"{value!r}")


def _as(hint: Any, value: Any) -> Any:
    """Returns the value as `hint`, or None if it is not one (TOML has no null, so None is free)."""
    origin, arguments = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        found = (_as(option, value) for option in arguments if option is not type(None))
        return next((item for item in found if item is not None), None)
    if origin is tuple:
        return _as_tuple(arguments, value)
    if origin is dict:
        return value if isinstance(value, dict) else None
    if origin is not None:  # Literal
        return value if value in arguments else None
    if hint in (int, float) and type(value) is int:
        return hint(value) if abs(value) < _LARGE else None
    return value if type(value) is hint else None


def _as_tuple(arguments: tuple[Any, ...], value: Any) -> tuple[Any, ...] | None:
    if not isinstance(value, list):
        return None
    items: list[Any] = value  # pyright: ignore[reportUnknownVariableType]
    open_ended = arguments[-1] is Ellipsis
    if not open_ended and len(items) != len(arguments):
        return None
    hints = [arguments[0]] * len(items) if open_ended else list(arguments)
    converted = [_as(hint, item) for hint, item in zip(hints, items, strict=True)]
    return None if any(item is None for item in converted) else tuple(converted)


def _describe(hint: Any) -> str:
    names = {int: "a whole number", float: "a number", str: "a text", bool: "true or false", Table: "a table"}
    if hint in names:
        return names[hint]
    arguments = [argument for argument in get_args(hint) if argument is not type(None)]
    if get_origin(hint) is tuple:
        size = "" if arguments[-1] is Ellipsis else f"{len(arguments)} "
        return f"a list of {size}values, each {_describe(arguments[0])}"
    if get_origin(hint) in (Union, types.UnionType):
        return " or ".join(_describe(argument) for argument in arguments)
    if arguments:
        return "one of " + ", ".join(repr(argument) for argument in arguments)
    return "a table"


def _line_of(text: str, path: tuple[str, ...]) -> int:
    """Returns the line of a key, 1-based, or else of its table's header; 0 if neither is found."""
    *table, key = path
    current: list[str] = []
    header_line = 0
    for number, line in enumerate(text.splitlines(), start=1):
        if header := re.match(r"\s*\[+\s*([^\]]+?)\s*\]+", line):
            current = [part.strip().strip("\"'") for part in header.group(1).split(".")]
            if current == [*table, key]:
                return number
            header_line = number if current == table else header_line
        elif (found := re.match(r"\s*([A-Za-z0-9_.\"'-]+)\s*=", line)) and [
            *current,
            *(part.strip("\"' ") for part in found.group(1).split(".")),
        ] == [*table, key]:
            return number
    return header_line
