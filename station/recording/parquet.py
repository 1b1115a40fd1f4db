"""Reads Parquet tables, after their own account of what they hold: a file of some kB may unpack to gigabytes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from shared.errors import UserError
from station.recording.parquet_values import values_of

MOST_ROWS = 1_000_000
"""Three hours of frames at 90 Hz, or fifty times the longest session; as samples they take 0.6 GB."""
MOST_CELLS = 10_000_000
"""The rows of all columns together, and of lists their items: as Python's numbers some 65 bytes each. Those of a CSV
table come to 770 MB (`pytest -m benchmark -s tests/benchmarks/test_table_memory.py` prints it)."""
MOST_BYTES = 256 * 1024 * 1024
"""The size of all that is unpacked, and of all texts where each is written out: one text may stand for a million."""


ROW_NUMBERS = "__index_level_"
"""The names begin so by which pandas stores the numbers of rows that were sorted or chosen: they are no column."""


def read_parquet(path: Path) -> Any:
    """Reads the table (of `pyarrow`) in a file, without the row numbers of pandas.

    Raises:
        UserError: if it holds more than fits into memory.
        OSError, pyarrow.ArrowException: if it cannot be read, or is no Parquet table.
    """
    import pyarrow.parquet as pq  # noqa: PLC0415  # slow to load, and most tables are CSV

    with pq.ParquetFile(path) as file:
        leaves = [file.schema.column(number) for number in range(len(file.schema))]
        _require_within(path, file.metadata, leaves)
        texts = [leaf.path for leaf in leaves if _is_text(leaf)]
        kinds = file.schema_arrow
    with pq.ParquetFile(path, read_dictionary=texts) as file:
        packed = file.read()
    chunks = [chunk for column in packed.columns for chunk in column.chunks]
    written_out = sum(_text_bytes(leaf) for chunk in chunks for leaf in _leaves(chunk))
    _refuse(path, "MB of text", written_out / 1e6, MOST_BYTES / 1e6)
    table = _written_out(packed, kinds)
    return table.select([name for name in table.column_names if not name.startswith(ROW_NUMBERS)])


def _require_within(path: Path, metadata: Any, leaves: Sequence[Any]) -> None:
    groups = [metadata.row_group(number) for number in range(metadata.num_row_groups)]
    rows = max(metadata.num_rows, sum(group.num_rows for group in groups))
    _refuse(path, "rows", rows, MOST_ROWS)
    listed = any(leaf.max_repetition_level for leaf in leaves)
    counts = list(zip(values_of(path) if listed else [rows] * len(leaves), leaves, strict=False))
    _refuse(path, "cells", max(sum(count for count, _ in counts), rows * metadata.num_columns), MOST_CELLS)
    packed = sum(group.total_byte_size for group in groups)
    # A value of a fixed length may stand in the file once, but in memory it stands in each row.
    fixed = sum(count * leaf.length for count, leaf in counts if leaf.physical_type == "FIXED_LEN_BYTE_ARRAY")
    _refuse(path, "MB", max(packed, fixed) / 1e6, MOST_BYTES / 1e6)


def _refuse(path: Path, what: str, found: float, most: float) -> None:
    if found > most:
        raise UserError(f"Expected at most {most:.0f} {what} in {path}, it holds {found:.0f}; split the table")


def _is_text(leaf: Any) -> bool:
    return leaf.physical_type == "BYTE_ARRAY"


def _leaves(array: Any) -> Iterator[Any]:
    """Yields the arrays of which an array of lists, records and maps consists; an array of single values is its own."""
    import pyarrow as pa  # noqa: PLC0415  # as above

    kind = array.type
    if pa.types.is_map(kind):
        parts = [array.keys, array.items]
    elif pa.types.is_struct(kind):
        parts = array.flatten()
    elif pa.types.is_nested(kind):
        parts = [array.flatten()]
    else:
        yield array
        return
    for part in parts:
        yield from _leaves(part)


def _text_bytes(array: Any) -> int:
    """Returns the size of the texts in an array, if each is written out."""
    import pyarrow as pa  # noqa: PLC0415  # as above
    import pyarrow.compute as pc  # noqa: PLC0415

    if not pa.types.is_dictionary(array.type):
        return array.nbytes
    lengths = pc.call_function("binary_length", [array.dictionary]).cast("int64")
    return pc.call_function("sum", [lengths.take(array.indices)]).as_py() or 0


def _written_out(packed: Any, kinds: Any) -> Any:
    """Returns the table with the kinds of columns that its file has.

    A kind that texts cannot be written as stays packed.
    """
    import pyarrow as pa  # noqa: PLC0415  # as above

    for number, kind in enumerate(kinds):
        try:
            packed = packed.set_column(number, kind, packed.column(number).cast(kind.type))
        except pa.ArrowNotImplementedError:  # views of texts are such a kind
            continue
    return packed
