"""Reads a table of tracks, .csv or .parquet: its columns as SI numbers, or names, and what is left alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from shared.errors import UserError
from shared.geometry import Array
from station.recording.cells import Cells, cells_of, numbers_of
from station.recording.importers.tracks.plausible import refuse_unlikely
from station.recording.importers.tracks.units import NAME, QUANTITIES, columns_of


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
        quantity: numbers_of(cells[column.name], column.name, path) * column.factor
        for quantity, column in found.items()
        if QUANTITIES[quantity] is not NAME
    }
    if not len(numbers["run"]):
        raise UserError(f"Expected at least one row in {path}, found none")
    refuse_unlikely(found, numbers, path)
    group = found.get("group")
    named = () if group is None else tuple("" if cell is None else str(cell) for cell in cells[group.name])
    return Tracks(source=str(path), numbers=numbers, group=named, ignored=ignored)


def _cells(path: Path) -> Cells:
    try:
        if path.suffix not in (".csv", ".parquet"):
            path.open("rb").close()
            raise UserError(f"Expected a table of tracks that ends in .csv or .parquet, got '{path.name}'")
        return cells_of(path, what="tracks")
    except OSError as error:
        why = error.strerror or error if path.exists() else "there is no such file"
        raise UserError(f"Expected a table of tracks at {path}, but it cannot be read: {why}") from error
