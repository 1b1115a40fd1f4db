"""Texts of strangers: how much of them is read, and what a terminal would obey is shown instead."""

from __future__ import annotations

from typing import Any, cast

LONGEST = 1600
"""Letters of a sentence: twenty lines of a terminal."""
_GAP = " … "
_END = (LONGEST - len(_GAP)) // 2
_SHOWN = (
    {code: chr(0x2400 + code) for code in range(0x20) if chr(code) not in "\n\t"}
    | {0x7F: "\u2421"}
    | dict.fromkeys(range(0x80, 0xA0), "\ufffd")
)


def visible(text: str) -> str:
    """Returns the text with Unicode's pictures of control characters in their place; new lines and tabs stay.

    A recording, a table or a message may hold sequences that clear a terminal, or make it show what was never said.
    """
    return text.translate(_SHOWN)


def visible_in(value: Any) -> Any:
    """Returns a value that was read from JSON, with all its texts visible."""
    if isinstance(value, str):
        return visible(value)
    if isinstance(value, list):
        return [visible_in(one) for one in cast(list[Any], value)]
    if isinstance(value, dict):
        return {visible(key): visible_in(one) for key, one in cast(dict[str, Any], value).items()}
    return value


def shortened(text: str) -> str:
    """Returns a text without its middle where it is longer than a sentence; to shorten it again changes nothing."""
    return text if len(text) <= LONGEST else f"{text[:_END]}{_GAP}{text[-_END:]}"


def sentence(text: str) -> str:
    """Returns a sentence for a terminal: visible, and without its middle where a stranger's words make it long."""
    return shortened(visible(text))
