"""Defines what is told below every figure of every page: what it shows, of how many, how sure, and how it is made."""

from __future__ import annotations

import shlex
from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from html import escape

_command: ContextVar[str] = ContextVar("command")


@contextmanager
def made_by(command: str) -> Generator[None]:
    """Has every figure and page that is written meanwhile name the command that makes it again."""
    before = _command.set(command)
    try:
        yield
    finally:
        _command.reset(before)


def command(default: str = "") -> str:
    """Returns the command of the page that is being written, or else the default.

    Raises:
        LookupError: outside of `made_by`, if there is no default.
    """
    return _command.get(default) if default else _command.get()


def command_line(*words: object, **options: object) -> str:
    """Returns the words and options as they are typed in a shell; options that are None or False are left out."""
    typed = [shlex.quote(str(word)) for word in words]
    for name, value in options.items():
        if value is None or value is False:
            continue
        flag = f"--{name.replace('_', '-')}"
        typed += [flag] if value is True else [flag, shlex.quote(str(value))]
    return " ".join(typed)


@dataclass(frozen=True, kw_only=True)
class Caption:
    """The words below a figure.

    Attributes:
        shows: what it shows, as whole sentences.
        count: of how many, as in "63 runs".
        interval: what its bars and bands are, as in "bars: 90 % intervals"; empty where it has none.
    """

    shows: str
    count: str
    interval: str = ""

    @property
    def text(self) -> str:
        """All of it as plain text, which goes into the figure's own files."""
        return f"{self.shows} {self._number}. Made by: {command()}"

    @property
    def html(self) -> str:
        """All of it below the drawing."""
        return (
            f"<figcaption>{escape(self.shows)} {escape(self._number)}. Made by <code>{escape(command())}</code>"
            "</figcaption>"
        )

    @property
    def _number(self) -> str:
        return "; ".join(filter(None, (f"n = {self.count}", self.interval)))
