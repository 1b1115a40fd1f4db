"""Columns over the stacked rows of all channels, of which only what is not zero is kept.

Most numbers of a model change few channels: of 550 columns of a session a tenth changes the shape of the marks, which
has half of the rows. A session's columns in full would be what a diagnosis needs the most memory for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from station.diagnosis.observations.evidence import Evidence
from station.physics.contact import Array

Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Piece:
    """The columns numbered `columns` of the rows from `first` on, as `values` (n, columns)."""

    first: int
    columns: tuple[int, ...]
    values: Array

    @property
    def span(self) -> tuple[int, int]:
        """The first of its rows, and the first beyond them."""
        return self.first, self.first + len(self.values)


@dataclass(frozen=True, eq=False)
class Table:
    """Columns (rows, K), `shape`, as pieces; everywhere else they are zero."""

    shape: tuple[int, int]
    pieces: tuple[Piece, ...] = ()

    def of(self, rows: Index) -> Array:
        """Returns some of the rows (m,) in full: (m, K)."""
        found = np.zeros((len(rows), self.shape[1]))
        # Hundreds of pieces are of a few channels, whose rows are sought once.
        inside = {
            span: np.flatnonzero((rows >= span[0]) & (rows < span[1])) for span in {one.span for one in self.pieces}
        }
        for piece in self.pieces:
            at = inside[piece.span]
            found[at[:, None], np.array(piece.columns)] = piece.values[rows[at] - piece.first]
        return found

    def whole(self) -> Array:
        """Returns all rows in full: (rows, K)."""
        return self.of(np.arange(self.shape[0]))

    def beside(self, other: Table) -> Table:
        """Returns these columns with another table's after them."""
        moved = (_renumbered(one, {index: index + self.shape[1] for index in one.columns}) for one in other.pieces)
        return Table((self.shape[0], self.shape[1] + other.shape[1]), (*self.pieces, *moved))

    def chosen(self, columns: Sequence[int]) -> Table:
        """Returns the columns with these numbers, in that order."""
        number = {column: index for index, column in enumerate(columns)}
        kept = (_renumbered(one, number) for one in self.pieces)
        return Table((self.shape[0], len(columns)), tuple(one for one in kept if one.columns))


class Sloped(NamedTuple):
    """Columns of the residuals (rows, K), and of what friction undoes by them, see `likelihood.feedback`."""

    rows: Table
    decay: Table

    def beside(self, other: Sloped) -> Sloped:
        """Returns these columns with others after them."""
        return Sloped(self.rows.beside(other.rows), self.decay.beside(other.decay))

    def chosen(self, columns: Sequence[int]) -> Sloped:
        """Returns the columns with these numbers, in that order."""
        return Sloped(self.rows.chosen(columns), self.decay.chosen(columns))


def _renumbered(piece: Piece, number: Mapping[int, int]) -> Piece:
    """Returns the columns of a piece that have a new number, under it."""
    known = [index for index, column in enumerate(piece.columns) if column in number]
    columns = tuple(number[piece.columns[index]] for index in known)
    same = len(known) == len(piece.columns)
    return Piece(piece.first, columns, piece.values if same else piece.values[:, known])


def by_channel(evidence: Evidence, parts: Mapping[str, Array], columns: int) -> Table:
    """Returns columns (n, `columns`) of some of the channels by name; the other channels' are zero."""
    return Table((sum(map(len, evidence.channels)), columns), tuple(_pieces(evidence, parts)))


def _pieces(evidence: Evidence, parts: Mapping[str, Array]) -> Iterator[Piece]:
    first = 0
    for channel in evidence.channels:
        values = parts.get(channel.name)
        acting = np.zeros(0, dtype=np.int64) if values is None else np.flatnonzero(values.any(axis=0))
        if values is not None and len(acting):
            kept = values if len(acting) == values.shape[1] else values[:, acting]
            yield Piece(first, tuple(acting.tolist()), kept)
        first += len(channel)


def sloped(
    evidence: Evidence, rows: Mapping[str, Array], columns: int, decay: Mapping[str, Array] | None = None
) -> Sloped:
    """Returns columns (n, `columns`) of some of the channels by name, with what they undo; the others' are zero."""
    return Sloped(by_channel(evidence, rows, columns), by_channel(evidence, decay or {}, columns))


def side_by_side(evidence: Evidence, parts: Sequence[Sloped]) -> Sloped:
    """Returns the columns of all the parts, one after another."""
    whole = sloped(evidence, {}, 0)
    for part in parts:
        whole = whole.beside(part)
    return whole
