"""Sample tables: one row a run, the columns of `Sample`, as CSV or Parquet, and back.

Vectors are lists in Parquet and numbered columns in CSV (`euler_rad_0` to `euler_rad_2`); the flags are a list in
Parquet and one text in CSV, separated by `|`. Numbers and texts are written so that reading gives the same ones.
A table of another rig may have fewer columns (they keep their defaults) and others (they are left alone), but it must
have `onset_angle_rad`.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import fields
from itertools import chain
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, cast, get_type_hints

from shared.csv_text import csv_lines
from shared.errors import UserError
from shared.messages import Floats, Sample, Strings
from station.recording.cells import Cells, cells_of, short
from station.recording.reader import open_recording

if TYPE_CHECKING:
    import pyarrow as pa

LENGTHS = {"euler_rad": 3, "reference_corners_px": 8, "corner_variance_px2": 8, "post_corners_px": 8}
"""The least number of columns of a CSV file that a vector gets."""
REQUIRED = "onset_angle_rad"
_FLAG_SEPARATOR = "|"
_HINTS: dict[str, Any] = {
    name: hint for name, hint in get_type_hints(Sample).items() if name in {spec.name for spec in fields(Sample)}
}


def write_samples(
    samples: Sequence[Sample], path: Path, *, more: Mapping[str, Sequence[float]] = MappingProxyType({})
) -> None:
    """Writes a table; the name's ending (.csv or .parquet) says which.

    `more` has further columns, a number for each sample, nan where there is none.

    Raises:
        UserError: for another ending, or a folder that cannot be written to.
    """
    write = {".csv": _write_csv, ".parquet": _write_parquet}.get(path.suffix)
    if write is None:
        raise UserError(f"Expected a table's name to end in .csv or .parquet, got '{path.name}'")
    try:
        write(samples, path, more)
    except OSError as error:
        raise UserError(f"Expected to write the table to {path}, but that failed: {error.strerror}") from error


def known_columns() -> tuple[str, ...]:
    """Returns the names of a sample's columns."""
    return tuple(_HINTS)


def read_samples(path: Path, *, one_of: Collection[str] = (REQUIRED,)) -> tuple[Sample, ...]:
    """Reads the samples in a table (.csv, .parquet), which must have one of some columns, or in a recording (.mcap).

    Raises:
        UserError: if the file is missing, of another kind, lacks these columns, or holds something that is no number.
    """
    if path.suffix == ".mcap":
        return open_recording(path).samples()
    return samples_in(table_of(path, one_of=one_of), path)


def table_of(path: Path, *, one_of: Collection[str]) -> Cells:
    """Reads the cells of a table of samples (.csv, .parquet), which must have one of some columns.

    Raises:
        UserError: if the file is missing, of another kind, or lacks these columns.
    """
    if path.suffix not in (".csv", ".parquet"):
        raise UserError(f"Expected samples in a .csv, .parquet or .mcap file, got '{path.name}'")
    try:
        cells = cells_of(path, what="samples")
    except OSError as error:
        raise UserError(f"Expected a table of samples at {path}, but it cannot be read: {error}") from error
    _require(list(cells), path, one_of)
    return cells


def samples_in(cells: Cells, path: Path) -> tuple[Sample, ...]:
    """Returns the samples in the cells of the table at `path`.

    Raises:
        UserError: if a cell holds something that is no number.
    """
    return _read_parquet(cells, path) if path.suffix == ".parquet" else _read_csv(cells, path)


# --- Parquet ---------------------------------------------------------------------------------------------------------


def _write_parquet(samples: Sequence[Sample], path: Path, more: Mapping[str, Sequence[float]]) -> None:
    import pyarrow.parquet as pq  # noqa: PLC0415 - slow to load, and most tables are read from a recording

    pq.write_table(arrow_table(samples, more=more), path)


def arrow_table(  # pyright: ignore[reportUnknownParameterType]  # pyarrow has no types
    samples: Sequence[Sample], *, more: Mapping[str, Sequence[float]] = MappingProxyType({})
) -> pa.Table:
    """Returns the samples as a table of Arrow, with further columns as `write_samples` takes them."""
    import pyarrow as pa  # noqa: PLC0415

    kinds: dict[Any, pa.DataType] = {
        int: pa.int64(),
        float: pa.float64(),
        bool: pa.bool_(),
        str: pa.string(),
        Floats: pa.list_(pa.float64()),
        Strings: pa.list_(pa.string()),
    }
    columns = [
        pa.array([_plain(getattr(sample, name)) for sample in samples], type=kinds[hint])
        for name, hint in _HINTS.items()
    ]
    columns += [pa.array(list(values), type=pa.float64(), from_pandas=True) for values in more.values()]
    return pa.table(columns, names=[*_HINTS, *more])


def _plain(value: Any) -> Any:
    return list(cast(tuple[Any, ...], value)) if isinstance(value, tuple) else value


def _read_parquet(cells: Cells, path: Path) -> tuple[Sample, ...]:
    known = [name for name in _HINTS if name in cells]
    rows = zip(*(cells[name] for name in known), strict=True)
    return tuple(
        _from_row(dict(zip(known, row, strict=True)), number, path) for number, row in enumerate(rows, start=1)
    )


def _from_row(row: dict[str, Any], number: int, path: Path) -> Sample:
    values: dict[str, Any] = {}
    for name, value in row.items():
        if value is not None:
            values[name] = _checked(name, value, f"{path}, row {number}")
    return Sample(**values)


def _checked(name: str, value: Any, where: str) -> Any:
    hint = _HINTS[name]
    try:
        if hint in (Floats, Strings):
            kind = float if hint == Floats else str
            return tuple(_within(kind(item)) for item in value)
        return _within(hint(value))
    except (TypeError, ValueError, OverflowError) as error:
        raise UserError(f"{where}: expected {_wanted(hint)} for '{name}', got {short(value)}") from error


# --- CSV -------------------------------------------------------------------------------------------------------------


def _write_csv(samples: Sequence[Sample], path: Path, more: Mapping[str, Sequence[float]]) -> None:
    widths = {
        name: max([LENGTHS.get(name, 0), *(len(getattr(sample, name)) for sample in samples)])
        for name, hint in _HINTS.items()
        if hint == Floats
    }
    header = [*(column for name in _HINTS for column in _columns(name, widths)), *more]
    rows = (
        [
            *(cell for name in _HINTS for cell in _cells(name, getattr(sample, name), widths)),
            *("" if math.isnan(values[row]) else values[row] for values in more.values()),
        ]
        for row, sample in enumerate(samples)
    )
    with path.open("w", newline="", encoding="utf-8") as file:
        file.writelines(csv_lines(chain([header], rows)))


def _columns(name: str, widths: dict[str, int]) -> list[str]:
    return [f"{name}_{index}" for index in range(widths[name])] if name in widths else [name]


def _cells(name: str, value: Any, widths: dict[str, int]) -> list[str]:
    hint = _HINTS[name]
    if name in widths:
        return [*(repr(float(item)) for item in value), *[""] * (widths[name] - len(value))]
    if hint == Strings:
        return [_FLAG_SEPARATOR.join(value)]
    return [value if hint is str else repr(hint(value)).lower()]


def _read_csv(cells: Cells, path: Path) -> tuple[Sample, ...]:
    rows = zip(*cells.values(), strict=True)
    return tuple(
        _from_cells(dict(zip(cells, row, strict=True)), f"{path}, row {number}")
        for number, row in enumerate(rows, start=1)
    )


def _require(columns: Sequence[str], path: Path, one_of: Collection[str]) -> None:
    if not columns:
        raise UserError(f"Expected a table of samples in {path}, but the file is empty")
    if not set(one_of) & set(columns):
        found, wanted = ", ".join(columns[:8]), " or ".join(f"'{name}'" for name in one_of)
        raise UserError(f"Expected a table of samples with a column {wanted} in {path}; its columns are: {found}")


def _from_cells(row: dict[str, str], where: str) -> Sample:
    values: dict[str, Any] = {}
    for name, hint in _HINTS.items():
        if hint == Floats:
            cells = _numbered(name, row)
            while cells and not cells[-1]:
                cells.pop()
            values[name] = tuple(_number(cell, f"{name}_{index}", float, where) for index, cell in enumerate(cells))
        elif row.get(name):
            values[name] = _from_cell(name, row[name], where)
    return Sample(**values)


def _numbered(name: str, row: dict[str, str]) -> list[str]:
    cells: list[str] = []
    while (column := f"{name}_{len(cells)}") in row:
        cells.append(row[column])
    return cells


def _from_cell(name: str, cell: str, where: str) -> Any:
    hint = _HINTS[name]
    if hint == Strings:
        return tuple(cell.split(_FLAG_SEPARATOR))
    if hint is str:
        return cell
    if hint is bool:
        if cell.lower() not in ("true", "false", "1", "0"):
            raise UserError(f"{where}: expected true or false for '{name}', got '{cell}'")
        return cell.lower() in ("true", "1")
    return _number(cell, name, hint, where)


def _number(cell: str, name: str, kind: Any, where: str) -> Any:
    try:
        return _within(kind(cell))
    except ValueError as error:
        raise UserError(f"{where}: expected {_wanted(kind)} for '{name}', got '{short(cell)}'") from error


def _within(value: Any) -> Any:
    """Returns the value, unless it is a whole number of more than 64 bits, which no sample holds.

    Raises:
        ValueError: if it is.
    """
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        raise ValueError("it has more than 64 bits")
    return value


def _wanted(hint: Any) -> str:
    names = {
        int: "a whole number",
        float: "a number",
        bool: "true or false",
        Floats: "a list of numbers",
    }
    return names.get(hint, "a text")
