"""Reads the cells of a table, .csv or .parquet, by column, as its file has them."""

from __future__ import annotations

import csv
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from shared.csv_text import plain
from shared.errors import UserError
from shared.geometry import Array
from station.recording.parquet import MOST_BYTES, MOST_CELLS, MOST_ROWS, read_parquet

Cells = Mapping[str, Sequence[Any]]
"""The cells of each column, by its name: texts of a CSV table, values of a Parquet table, None where there is none."""

_SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}
_DECIMALS = "; numbers with a decimal comma need semicolons between the cells"
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d*,\d+([eE][+-]?\d+)?\s*")
_SHOWN = 40
"""Letters of a wrong value that a message shows."""


def cells_of(path: Path, *, what: str) -> Cells:
    """Reads all columns of a table of `what` ("samples"), as messages call it.

    Raises:
        UserError: if it is neither, has rows of unequal lengths, or more than fits into memory.
        OSError: if it cannot be read.
    """
    return _of_parquet(path, what) if path.suffix == ".parquet" else _of_csv(path, what)


def numbers_of(cells: Sequence[Any], name: str, path: Path, *, least: float = -math.inf) -> Array:
    """Returns the numbers (n,) in the column `name` of a table at `path`; nan for an empty cell.

    Raises:
        UserError: for a cell that is no number, or is infinite, or less than `least`.
    """
    return np.array([_number(cell, name, least, f"{path}, row {row}") for row, cell in enumerate(cells, start=1)])


def short(value: Any) -> str:
    """Returns a wrong value as a message shows it."""
    text = value if isinstance(value, str) else repr(value)
    return text if len(text) <= _SHOWN else text[:_SHOWN] + "…"


def _of_csv(path: Path, what: str) -> Cells:
    _require_small(path)
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            separator = _separator(next(filter(str.strip, file), ""))
            file.seek(0)
            lines = filter(None, csv.reader(file, delimiter=separator))
            header = [plain(name.strip()) for name in next(lines, [])]
            _require_once(header, path)
            columns = _columns(_whole(lines, len(header), separator, path), len(header))
    except (UnicodeDecodeError, csv.Error) as error:
        raise UserError(f"Expected a CSV table of {what}, but {path} is not one ({error})") from error
    if separator == ";":
        for column in columns:
            column[:] = map(_with_point, column)
    return dict(zip(header, columns, strict=True))


def _require_small(path: Path) -> None:
    size = path.stat().st_size
    if size > MOST_BYTES:
        raise UserError(
            f"Expected at most {MOST_BYTES / 1e6:.0f} MB in {path}, it holds {size / 1e6:.0f}; split the table"
        )


def _separator(header: str) -> str:
    """Returns what separates the names in a header: a comma, a semicolon or a tab."""
    return max(_SEPARATORS, key=header.count)


def _require_once(header: Sequence[str], path: Path) -> None:
    counts = Counter(filter(None, header))
    twice = next((name for name, count in counts.items() if count > 1), None)
    if twice is not None:
        raise UserError(f"Expected each column once in {path}, got '{twice}' {counts[twice]} times; rename one")


def _whole(lines: Iterable[list[str]], columns: int, separator: str, path: Path) -> Iterator[list[str]]:
    """Yields the rows as they are read; refuses one of another length, and more than fit into memory."""
    for number, row in enumerate(lines, start=1):
        if len(row) != columns:
            raise UserError(
                f"{path}, row {number}: expected {columns} cells between {_SEPARATORS[separator]}, as many as there "
                f"are columns, got {len(row)}{_DECIMALS if separator == ',' else ''}"
            )
        for what, count, most in (("rows", number, MOST_ROWS), ("cells", number * columns, MOST_CELLS)):
            if count > most:
                raise UserError(f"Expected at most {most} {what} in {path}, it holds more; split the table")
        yield row


def _columns(rows: Iterable[list[str]], count: int) -> list[list[str]]:
    """Turns rows into columns as they are read: beside the cells there is never more than one row."""
    columns: list[list[str]] = [[] for _ in range(count)]
    for row in rows:
        for column, cell in zip(columns, row, strict=True):
            column.append(plain(cell))
    return columns


def _with_point(cell: str) -> str:
    """Returns a number with a decimal comma with a point; whatever else as it is."""
    return cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell


def _of_parquet(path: Path, what: str) -> Cells:
    import pyarrow as pa  # noqa: PLC0415 - slow to load, and most tables are CSV

    try:
        return _ParquetCells(path, read_parquet(path))
    except (pa.ArrowException, ValueError, KeyError) as error:
        raise UserError(f"Expected a Parquet table of {what}, but {path} is not one ({error})") from error


class _ParquetCells(Mapping[str, Sequence[Any]]):
    """The columns of a Parquet table (of `pyarrow`), each unpacked when it is asked for: others may be of any kind."""

    def __init__(self, path: Path, table: Any) -> None:
        self._path, self._table = path, table

    def __getitem__(self, name: str) -> Sequence[Any]:
        import pyarrow as pa  # noqa: PLC0415 - as above

        if name not in self:
            raise KeyError(name)
        try:
            return self._table.column(name).to_pylist()
        except (pa.ArrowException, ValueError, OverflowError) as error:
            raise UserError(f"Expected numbers or texts in the column '{name}' of {self._path}: {error}") from error

    def __contains__(self, name: object) -> bool:
        return name in self._table.column_names

    def __iter__(self) -> Iterator[str]:
        return iter(self._table.column_names)

    def __len__(self) -> int:
        return len(self._table.column_names)


def _number(cell: Any, name: str, least: float, where: str) -> float:
    if cell is None or cell == "":
        return math.nan
    try:
        value = float(cell)
    except (TypeError, ValueError, OverflowError) as error:
        raise UserError(f"{where}: expected a number for '{name}', got '{short(cell)}'") from error
    if math.isinf(value) or value < least:
        bound = "" if math.isinf(least) else f" of at least {least:g}"
        raise UserError(f"{where}: expected a finite '{name}'{bound}, got {value:g}")
    return value
