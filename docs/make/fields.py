"""The fields of a dataclass as rows of a page: name, type, default, and what the source says below the field."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Sequence
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import cache
from typing import Any, Literal, get_args, get_origin, get_type_hints

from shared.config import Table
from shared.messages import Message

TABLE = "table"
"""The type of a key that is a table of its own."""
_IN_WORDS = {str: "text", float: "number", int: "whole number", bool: "true or false"}


def heading(level: int, text: str) -> str:
    """A heading, 1 the largest."""
    return f"{'#' * level} {text}"


def rows(header: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    told = ["| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in (header, *lines)]
    return "\n".join([told[0], "|" + "---|" * len(header), *told[1:]])


def words_of(cls: type[Any]) -> str:
    """The docstring of a class as one text."""
    return inspect.cleandoc(cls.__doc__ or "")


@cache
def said_of_fields(cls: type[Any]) -> dict[str, str]:
    """The texts that stand below fields in the source, by the field's name."""
    (body,) = ast.parse(textwrap.dedent(inspect.getsource(cls))).body
    assert isinstance(body, ast.ClassDef)
    said = dict[str, str]()
    for line, below in zip(body.body, body.body[1:], strict=False):
        if isinstance(line, ast.AnnAssign) and isinstance(line.target, ast.Name) and isinstance(below, ast.Expr):
            said[line.target.id] = " ".join(str(ast.literal_eval(below.value)).split())
    return said


def types_of(cls: type[Any]) -> dict[str, Any]:
    """The types of a class's fields."""
    hints = get_type_hints(cls)
    return {spec.name: hints[spec.name] for spec in fields(cls)}


def type_in_words(hint: Any) -> str:
    """A type as a reader of TOML or of a message names it."""
    if get_origin(hint) is Literal:
        return " or ".join(f'"{choice}"' for choice in get_args(hint))
    if get_origin(hint) is tuple:
        inner = get_args(hint)
        return (
            f"list of {type_in_words(inner[0])}"
            if inner[-1] is Ellipsis
            else f"{len(inner)} × {type_in_words(inner[0])}"
        )
    if args := [arg for arg in get_args(hint) if arg is not type(None)]:
        return " or ".join(map(type_in_words, args))
    if not isinstance(hint, type):
        return str(hint)
    if issubclass(hint, Message):
        return f"`{hint.__name__}`"
    return TABLE if hint is Table or is_dataclass(hint) else _IN_WORDS.get(hint, hint.__name__)


def default_in_words(spec: Field[Any]) -> str:
    """The default of a field as TOML writes it; nothing for a table, and "needed" where there is none."""
    value = spec.default if spec.default is not MISSING else spec.default_factory
    if value is MISSING:
        return "needed"
    if callable(value):
        return ""
    return _as_toml(value)


def _as_toml(value: Any) -> str:
    if value is None or is_dataclass(value):
        return ""
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, tuple):
        return f"`[{', '.join(_as_toml(item).strip('`') for item in value)}]`"
    return f'`"{value}"`' if isinstance(value, str) else f"`{value}`"
