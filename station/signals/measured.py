"""A table of friction measurements: one sample for each row, and what a row has besides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from shared.messages import Sample

Column = NDArray[np.float64]


def left_alone(names: Sequence[str]) -> str:
    """Says in words that nothing reads the columns of these names."""
    return f"columns that nothing reads were left alone: {', '.join(name or 'one without a name' for name in names)}"


@dataclass(frozen=True, eq=False, kw_only=True)
class Measured:
    """The rows of a table, n of them.

    `more` has the numbers (n,) that a `Sample` lacks, by their columns' names, nan where a row has none. `group` has
    the name of each row's group (sequence, day, specimen), within which rows are alike; it is empty without groups.
    `ignored` are the names of the columns that nothing reads.
    """

    samples: tuple[Sample, ...]
    more: Mapping[str, Column] = field(default_factory=dict[str, Column])
    group: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()

    @classmethod
    def of(cls, samples: Sequence[Sample]) -> Self:
        """Samples with nothing besides."""
        return cls(samples=tuple(samples))

    def __len__(self) -> int:
        return len(self.samples)

    def column(self, name: str) -> Column:
        """Returns the numbers (n,) of a column; nan where there are none."""
        return self.more.get(name, np.full(len(self), np.nan))
