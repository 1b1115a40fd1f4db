"""Reads a table of tracks, .csv or .parquet: its columns as SI numbers, or names, and what is left alone."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from shared.errors import UserError
from shared.geometry import Array
from station.recording.importers.tracks.plausible import refuse_unlikely
from station.recording.importers.tracks.units import NAME, QUANTITIES, Column, columns_of
from station.recording.parquet import read_parquet


@dataclass(frozen=True, eq=False, kw_only=True)
class Tracks:
    """A table of n rows: `numbers` (n,) by quantity in SI units, nan where a cell is empty, and `group` (n,) or empty.

    `source` is the file's name for messages, and `ignored` are the columns that nothing reads, with what to do.
    """

    source: str
    numbers: Mapping[str, Array]
    group: tuple[str, ...]
    ignored: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.numbers["run"])

    def __contains__(self, quantity: str) -> bool:
        return quantity in self.numbers

    def has(self, *quantities: str) -> bool:
        """Returns true if it has all of these."""
        return all(quantity in self.numbers for quantity in quantities)


def read_table(path: Path) -> Tracks:
    """Reads the table in a file.

    Raises:
        UserError: if it is missing, no table, has no run or no time, a name misspelt without which there is no track, a
            cell that is no number, or one beyond all benches.
    """
    cells = _cells(path)
    found, ignored = columns_of(list(cells), str(path))
    for quantity, name in (("run", "run"), ("t", "t_s")):
        if quantity not in found:
            listed = ", ".join(list(cells)[:8]) or "none"
            raise UserError(f"Expected a column '{name}' in {path}, found none; its columns are: {listed}")
    numbers = {
        quantity: _numbers(cells[column.name], column, path)
        for quantity, column in found.items()
        if QUANTITIES[quantity] is not NAME
    }
    if not len(numbers["run"]):
        raise UserError(f"Expected at least one row in {path}, found none")
    refuse_unlikely(found, numbers, path)
    group = found.get("group")
    named = () if group is None else tuple("" if cell is None else str(cell) for cell in cells[group.name])
    return Tracks(source=str(path), numbers=numbers, group=named, ignored=ignored)


def _cells(path: Path) -> dict[str, Sequence[Any]]:
    read = {".csv": _of_csv, ".parquet": _of_parquet}.get(path.suffix)
    try:
        if read is None:
            path.open("rb").close()
            raise UserError(f"Expected a table of tracks that ends in .csv or .parquet, got '{path.name}'")
        return read(path)
    except OSError as error:
        why = error.strerror or error if path.exists() else "there is no such file"
        raise UserError(f"Expected a table of tracks at {path}, but it cannot be read: {why}") from error


def _of_csv(path: Path) -> dict[str, Sequence[Any]]:
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            delimiter = delimiter_of(file.readline())
            file.seek(0)
            reader = csv.reader(file, delimiter=delimiter)
            header = [name.strip() for name in next(reader, [])]
            rows = [row for row in reader if row]
    except (UnicodeDecodeError, csv.Error) as error:
        raise UserError(f"Expected a CSV table of tracks, but {path} is none ({error})") from error
    if delimiter == ";":
        rows = [[_with_point(cell) for cell in row] for row in rows]
    short = next((number for number, row in enumerate(rows, start=1) if len(row) != len(header)), None)
    if short is not None:
        got = len(rows[short - 1])
        raise UserError(
            f"{path}, row {short}: expected {len(header)} cells between {_IN_WORDS[delimiter]}, as many as there are "
            f"columns, got {got}{_DECIMALS if delimiter == ',' else ''}"
        )
    return {name: [row[index] for row in rows] for index, name in enumerate(header)}


_IN_WORDS = {",": "commas", ";": "semicolons", "\t": "tabs"}
_DECIMALS = "; numbers with a decimal comma need semicolons between the cells"
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d*,\d+([eE][+-]?\d+)?\s*")


def delimiter_of(header: str) -> str:
    """Returns what separates the names in a header: a comma, a semicolon or a tab."""
    return max(_IN_WORDS, key=header.count)


def _with_point(cell: str) -> str:
    """Returns a number with a decimal comma with a point; whatever else as it is."""
    return cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell


def _of_parquet(path: Path) -> dict[str, Sequence[Any]]:
    import pyarrow as pa  # noqa: PLC0415 - slow to load, and most tables are CSV

    try:
        table = read_parquet(path)
        return {name: table.column(name).to_pylist() for name in table.column_names}
    except (pa.ArrowException, ValueError, KeyError) as error:
        raise UserError(f"Expected a Parquet table of tracks, but {path} is none ({error})") from error


def _numbers(cells: Sequence[Any], column: Column, path: Path) -> Array:
    return np.array([_number(cell, column.name, f"{path}, row {row}") for row, cell in enumerate(cells, start=1)]) * (
        column.factor
    )


def _number(cell: Any, name: str, where: str) -> float:
    if cell is None or cell == "":
        return float("nan")
    try:
        value = float(cell)
    except (TypeError, ValueError) as error:
        raise UserError(f"{where}: expected a number for '{name}', got {str(cell)[:40]!r}") from error
    if np.isinf(value):
        raise UserError(f"{where}: expected a finite number for '{name}', got {value}")
    return value
