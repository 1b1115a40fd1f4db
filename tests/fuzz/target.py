"""A thing to fuzz: how its inputs are made, and how one is read."""

from __future__ import annotations

import contextlib
import importlib
import io
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from random import Random

from shared.errors import UserError
from station.__main__ import main
from tests.fuzz import targets

Maker = Callable[[Random], bytes]
Reader = Callable[[Path], None]


@dataclass(frozen=True)
class Target:
    """`make` gives an input, `read` takes the file that it was written to.

    A reader returns, or raises UserError with one clear sentence; anything else is a finding. `share` is how often it
    is drawn beside the others: what takes milliseconds is read more often than what takes a second.
    """

    name: str
    suffix: str
    make: Maker
    read: Reader
    share: float = 1.0


class Unclear(Exception):
    """A reader did something that it may not do, which is no exception of its own."""


def command(*words: str) -> Reader:
    """A reader that runs `station` with these words, `{file}` being the file's path."""

    def read(path: Path) -> None:
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), contextlib.chdir(path.parent):
            status = main([word.replace("{file}", path.name) for word in words])
        said = err.getvalue()
        if status not in (0, 1, 2):
            raise Unclear(f"exit status {status}: {said}")
        for text in (out.getvalue(), said):
            refuse_control(text)
        if status == 2:
            raise UserError(said.strip().removeprefix("station"))

    return read


def refuse_unclear(sentence: str) -> None:
    """Raises Unclear if a user's message is empty, a traceback, or longer than anybody reads."""
    if not sentence.strip() or "Traceback" in sentence or len(sentence) > 2000:
        raise Unclear(f"no clear sentence ({len(sentence)} letters): {sentence[:300]!r}")


def refuse_control(text: str) -> None:
    """Raises Unclear if a text holds what a terminal obeys: a stranger's file would clear it, or forge what it says."""
    found = {letter for letter in text if (ord(letter) < 32 and letter not in "\n\t") or 127 <= ord(letter) < 160}
    if found:
        place = min(text.index(letter) for letter in found)
        raise Unclear(f"control characters {sorted(found)} in {text[max(0, place - 80) : place + 80]!r}")


def all_targets() -> tuple[Target, ...]:
    """Every target of every file in `targets`."""
    names = sorted(module.name for module in pkgutil.iter_modules(targets.__path__))
    modules = [importlib.import_module(f"tests.fuzz.targets.{name}") for name in names]
    return tuple(target for module in modules for target in module.TARGETS)
