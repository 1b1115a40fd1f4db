"""CSV as every table of ours is written: a spreadsheet takes names for text, numbers for numbers, and runs nothing.

A spreadsheet runs a cell that begins with `=`, `+`, `-` or `@` as a formula, which may start programs or ask the
network, and names in a table come from recordings of strangers. Such a text gets an apostrophe before it, and begins no
formula then; a number with its sign is none and stays as it is. `plain` takes exactly the apostrophes that `csv_lines`
has put.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

_RUN = re.compile(r"'*[\s\x00-\x1f]*[=+\-@\uff1d\uff0b\uff0d\uff20]")
"""The beginning of a formula, also with the wide signs of East Asian keyboards, behind apostrophes that a text has."""
_NUMBER = re.compile(r"[+-]?[0-9]+(\.[0-9]*)?([eE][+-]?[0-9]+)?")
_SPECIAL = re.compile(r'[,"\r\n]')


def csv_lines(rows: Iterable[Sequence[str | float]]) -> Iterator[str]:
    """Yields a line for each row, the cells between commas and a new line at the end."""
    for row in rows:
        yield ",".join(map(_cell, row)) + "\n"


def plain(cell: str) -> str:
    """Returns the text of a cell that was read, without the apostrophe that `csv_lines` has put before it."""
    return cell[1:] if cell.startswith("'") and _RUN.match(cell, 1) else cell


def _cell(value: str | float) -> str:
    text = str(value)
    if _RUN.match(text) and not _NUMBER.fullmatch(text):
        text = f"'{text}"
    return '"' + text.replace('"', '""') + '"' if _SPECIAL.search(text) else text
