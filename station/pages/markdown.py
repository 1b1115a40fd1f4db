"""Texts within Markdown: names come from recordings of strangers, and nothing in them may be markup, HTML or a link."""

from __future__ import annotations

import re
from collections.abc import Iterable

from shared.visible import visible

_MARKUP = re.compile(r"([\\`*_\[\]<>#|&~$!])")
_LIST_OR_RULE = re.compile(r"^([0-9]*)([-+=.)])(?=[-+=\s]|$)")
_LINK = re.compile(r"(?i)(?<=:)(?=//)|(?<=www)(?=\.)")


def inline(text: str) -> str:
    """Returns a text that Markdown shows as it is, on one line: in a sentence, a heading, an item or a cell of a table.

    Blanks and new lines in a row become one blank, and control characters are shown.
    """
    line = _MARKUP.sub(r"\\\1", visible(" ".join(text.split())))
    return _LIST_OR_RULE.sub(r"\1\\\2", _LINK.sub(r"\\", line))


def row(cells: Iterable[str]) -> str:
    """Returns a row of a table."""
    return f"| {' | '.join(map(inline, cells))} |"
