"""Command lines: a parser that shows defaults where there are any, and proposes what may have been meant."""

from __future__ import annotations

import argparse
import difflib
import shutil
import textwrap
from collections.abc import Iterable
from itertools import groupby
from typing import Any, NoReturn

WIDTH = 120
"""The most letters in a line of a help's text, as in the sources: longer lines are hard to follow."""


def seed_of(word: str) -> int:
    """Returns the seed of random choices that a word gives: a whole number of 0 or more.

    Raises:
        ValueError: if it gives none.
    """
    number = int(word)
    if number < 0:
        raise ValueError(number)
    return number


def above_0(word: str) -> float:
    """Returns the number above 0 that a word gives.

    Raises:
        ValueError: if it gives none.
    """
    number = float(word)
    if not number > 0.0:
        raise ValueError(number)
    return number


_NUMBERS: dict[Any, str] = {
    int: "a whole number",
    float: "a number",
    seed_of: "a whole number of 0 or more",
    above_0: "a number above 0",
}
"""The words for what a number's type stands for."""


class WithDefaults(argparse.RawDescriptionHelpFormatter):
    """Help that states an option's default, unless its words do, or there is none (no value, a switch, an empty text).

    Descriptions and epilogs are as wide as the terminal; what is indented in them, as examples are, keeps its lines.
    """

    def __init__(self, prog: str, **options: Any) -> None:
        """Takes what `argparse.HelpFormatter` takes; without a width, that of the terminal up to WIDTH counts."""
        # Like argparse, two letters less: some terminals break a line that fills them.
        super().__init__(prog, **({"width": min(shutil.get_terminal_size().columns, WIDTH) - 2} | options))

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        parts = groupby(text.splitlines(), key=lambda line: line.strip() != "" and not line.startswith(" "))
        filled = (
            textwrap.wrap(" ".join(lines), width, break_on_hyphens=False) if in_words else lines
            for in_words, lines in parts
        )
        return "\n".join(f"{indent}{line}" for part in filled for line in part)

    def _get_help_string(self, action: argparse.Action) -> str | None:
        help_text = action.help or ""
        has_default = bool(action.option_strings) and action.default is not argparse.SUPPRESS
        if not has_default or action.default in (None, False, "", []) or callable(action.default):
            return help_text
        return help_text if "(default" in help_text else f"{help_text} (default: %(default)s)"


class Parser(argparse.ArgumentParser):
    """A parser that takes no abbreviated options, which would change their meaning when an option is added."""

    def __init__(self, **options: Any) -> None:
        """Takes what `argparse.ArgumentParser` takes."""
        ours: dict[str, Any] = {"formatter_class": WithDefaults, "allow_abbrev": False}
        super().__init__(**(ours | options))

    @property
    def actions(self) -> tuple[argparse.Action, ...]:
        """Everything that it takes, in the order of declaration."""
        return tuple(self._actions)

    def refuse(self, words: Iterable[str]) -> NoReturn:
        """Ends the program (2) over words that no option takes; names the nearest options."""
        known = [name for action in self._actions for name in action.option_strings]
        hints = (nearest(word.partition("=")[0], known) for word in words if word.startswith("-"))
        self.error(f"unrecognized arguments: {' '.join(words)}{next((hint for hint in hints if hint), '')}")

    def _get_value(self, action: argparse.Action, arg_string: str) -> Any:
        try:
            return super()._get_value(action, arg_string)
        except argparse.ArgumentError as error:
            if number := _NUMBERS.get(action.type):
                raise argparse.ArgumentError(action, f"expected {number}, got {arg_string!r}") from error
            raise

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        try:
            super()._check_value(action, value)
        except argparse.ArgumentError as error:
            if hint := nearest(str(value), [str(one) for one in action.choices or ()]):
                raise argparse.ArgumentError(action, f"expected a known word, got {value!r}{hint}") from error
            raise


def ending(*, one: str, example: str, stopped: str = "") -> str:
    """Returns the end of a command's help: its exit statuses and an example.

    `one` says what 1 means (empty: there is none), `stopped` what Ctrl-C gives where that is not 130.
    """
    by_one, but = (f" 1: {one};" if one else ""), (f", but {stopped}" if stopped else "")
    mistakes = "2: a mistake in what was asked; 70: a fault of the program"
    return f"Exit status: 0: done;{by_one} {mistakes}; 130: stopped by Ctrl-C{but}.\n\nExample:\n  {example}"


def nearest(word: str, known: Iterable[str], *, most: int = 1) -> str:
    """Returns the question whether one of the nearest known words, `most` at most, was meant; empty if none is near."""
    near = difflib.get_close_matches(word, list(known), n=most)
    return f"; did you mean {', '.join(near)}?" if near else ""
