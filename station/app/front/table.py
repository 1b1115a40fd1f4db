"""A table of a recording: columns of equal length, with their units at the end of their names."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from shared.installed import missing_as_user_error
from station.app.front.page import fragment
from station.pages import pieces

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

Column = NDArray[Any]

_FIRST = 3
_ROWS = 6


class Table:
    """Columns of equal length n, by name; a name ends in its unit (`_m`, `_rad`, `_ns`, `_px`), unless it has none.

    `table["tilt_rad"]` is one column. The arrays can be read and not written: the recording stays as it is.
    """

    def __init__(self, name: str, columns: Mapping[str, Column]) -> None:
        """Takes the table's name and its columns, each (n,)."""
        self.name = name
        self._columns = {key: _read_only(column) for key, column in columns.items()}

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of the columns, in order."""
        return tuple(self._columns)

    def __len__(self) -> int:
        return len(next(iter(self._columns.values()), ()))

    def __getitem__(self, name: str) -> Column:
        return self._columns[name]

    def to_numpy(self) -> dict[str, Column]:
        """Returns the columns by name, as arrays (n,) that cannot be written to."""
        return dict(self._columns)

    @missing_as_user_error()
    def to_pandas(self) -> pd.DataFrame:
        """Returns the table as a DataFrame with a row for each moment or run.

        Raises:
            UserError: if pandas is not installed.
        """
        import pandas as pd  # noqa: PLC0415  # an extra, and slow to load

        return pd.DataFrame(self._columns)

    @missing_as_user_error()
    def to_arrow(self) -> pa.Table:  # pyright: ignore[reportUnknownParameterType]  # pyarrow has no types
        """Returns the table in Arrow's form, which polars, DuckDB and Parquet take.

        Raises:
            UserError: if pyarrow is not installed.
        """
        import pyarrow as pa  # noqa: PLC0415  # an extra, and slow to load

        return pa.table({name: pa.array(column) for name, column in self._columns.items()})

    def __repr__(self) -> str:
        """Returns the columns with their first values, a line each; those that hold nothing in one line at the end."""
        known = {name: column for name, column in self._columns.items() if _says_something(column)}
        wide = max(map(len, known), default=0)
        lines = [f"  {name:{wide}}  {', '.join(_first(column))}" for name, column in known.items()]
        nothing = [name for name in self._columns if name not in known]
        ending = [f"  nothing in {', '.join(nothing)}"] if nothing else []
        return "\n".join([_count(self), *lines, *ending])

    def _repr_html_(self) -> str:
        """Returns the first rows, for a notebook."""
        first = [[escape(_digits(value)) for value in column[:_ROWS].tolist()] for column in self._columns.values()]
        rows = [list(row) for row in zip(*first, strict=True)]
        return fragment(pieces.table(self.columns, rows, caption=_count(self)))


def _read_only(column: Column) -> Column:
    seen = column.view()
    seen.flags.writeable = False
    return seen


def _says_something(column: Column) -> bool:
    """Returns true if any row has a value: a number that is one, or a text that is not empty."""
    if column.dtype.kind == "f":
        return not np.isnan(column).all()
    return len(column) > 0 and (column.dtype.kind not in "OU" or any(column.tolist()))


def _first(column: Column) -> list[str]:
    shown = [repr(value) if isinstance(value, str) else _digits(value) for value in column[:_FIRST].tolist()]
    return [*shown, "…"] if len(column) > _FIRST else shown


def _digits(value: object) -> str:
    """Returns a value in six digits; whole numbers, such as times, in all of theirs."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _count(table: Table) -> str:
    return f"{table.name}: {len(table)} row{'s' * (len(table) != 1)}"
