"""Prints sentences for people and for scripts."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text


def print_sentence(text: str) -> None:
    """Prints a sentence: on a terminal it is broken between words, and elsewhere it is one line, which scripts find."""
    console = Console(highlight=False)
    console.print(Text(text), soft_wrap=not console.is_terminal)
