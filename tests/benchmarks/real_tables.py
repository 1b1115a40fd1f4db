"""Real tables of friction, and copies of them with their labels dealt anew, in which friction depends on nothing.

- Silicone under 70 loads: what a sequence of constant load says goes to another load and another place in the order,
  and its cycles are shuffled. By the means of the sequences, and by their cycles.
- A step of the sliding speed: the record is cut in pieces of equal slip, which are put together in another order, and
  the pieces' speeds are dealt among them.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from station.physics.contact import Array

Columns = Mapping[str, NDArray[Any]]

PIECES = 40
STEP_M_S = (2e-7, 2e-6)
"""The two driving speeds, as the README of the data has them."""


@dataclass(frozen=True, eq=False)
class Silicone:
    """Cycles (n,): sequence from 0 on, normal load, sliding speed, coefficient, and its standard deviation."""

    sequence: np.ndarray[tuple[int], np.dtype[np.int64]]
    load_n: Array
    speed_m_s: Array
    coefficient: Array
    sd: Array

    @classmethod
    def of(cls, path: Path) -> Silicone:
        """Reads `friction.csv`."""
        table = np.genfromtxt(path, delimiter=",", names=True, usecols=range(6))
        named = ("normal_load_n", "sliding_speed_m_s", "friction_coefficient", "friction_coefficient_sd")
        return cls(table["sequence"].astype(np.int64) - 1, *(table[name] for name in named))

    def dealt(self, rng: np.random.Generator) -> Silicone:
        """Each sequence's cycles, shuffled, at another sequence's load and place in the order."""
        rows = [rng.permutation(np.flatnonzero(self.sequence == one)) for one in rng.permutation(self.count)]
        sequence = np.repeat(np.arange(self.count), [len(part) for part in rows])
        loads = np.array([self.load_n[self.sequence == one][0] for one in range(self.count)])
        order = np.concatenate(rows)
        return Silicone(sequence, loads[sequence], self.speed_m_s[order], self.coefficient[order], self.sd[order])

    @property
    def count(self) -> int:
        """The number of sequences."""
        return int(self.sequence.max()) + 1

    def cycles(self, path: Path, *, ordered: bool = True) -> Path:
        """A table of the cycles in groups, `ordered` by a column run."""
        columns = {
            "run": np.arange(len(self.sequence)) + 1,
            "sequence": self.sequence + 1,
            "normal_load_n": self.load_n,
            "sliding_speed_m_s": self.speed_m_s,
            "friction_coefficient": self.coefficient,
            "friction_coefficient_sd": self.sd,
        }
        return written(columns if ordered else less(columns, "run"), path)

    def means(self, path: Path, *, ordered: bool = True) -> Path:
        """A table of the sequences' means, `ordered` by a column run."""
        parts = [np.flatnonzero(self.sequence == one) for one in range(self.count)]
        columns = {
            "run": np.arange(self.count) + 1,
            "normal_load_n": np.array([self.load_n[part].mean() for part in parts]),
            "sliding_speed_m_s": np.array([self.speed_m_s[part].mean() for part in parts]),
            "friction_coefficient": np.array([self.coefficient[part].mean() for part in parts]),
        }
        return written(columns if ordered else less(columns, "run"), path)


@dataclass(frozen=True, eq=False)
class SpeedStep:
    """A record (n,): time, load-point displacement, coefficient."""

    time_s: Array
    displacement_m: Array
    coefficient: Array

    @classmethod
    def of(cls, path: Path) -> SpeedStep:
        """Reads `sepiolite.csv`."""
        table = np.genfromtxt(path, delimiter=",", names=True)
        return cls(table["time_s"], table["displacement_m"], table["friction_coefficient"])

    def record(self, path: Path) -> Path:
        """The record as it is."""
        names = ("time_s", "displacement_m", "friction_coefficient")
        return written(dict(zip(names, (self.time_s, self.displacement_m, self.coefficient), strict=True)), path)

    def dealt(self, path: Path, rng: np.random.Generator) -> Path:
        """A record of its pieces in another order, at speeds that were dealt among them."""
        slip = np.maximum.accumulate(self.displacement_m - self.displacement_m[0])
        edges = np.linspace(0.0, slip[-1], PIECES + 1)
        parts = np.split(np.arange(len(slip)), np.searchsorted(slip, edges[1:-1]))
        slow = np.array([np.ptp(self.time_s[part]) * STEP_M_S[1] > 3.0 * edges[1] for part in parts])
        speeds = np.where(rng.permutation(slow), *STEP_M_S)
        order = rng.permutation(PIECES)
        place = np.concatenate([edges[new] + slip[parts[old]] - edges[old] for new, old in enumerate(order)])
        speed = np.repeat(speeds, [len(parts[old]) for old in order])
        step = np.maximum(np.diff(np.maximum.accumulate(place), prepend=place[0]), 0.0)
        columns = {
            "time_s": np.cumsum(step / speed + 1e-3),
            "displacement_m": place,
            "sliding_speed_m_s": speed,
            "friction_coefficient": self.coefficient[np.concatenate([parts[old] for old in order])],
        }
        return written(columns, path)


def less(columns: Columns, name: str) -> Columns:
    """The columns without one of them."""
    return {key: values for key, values in columns.items() if key != name}


def written(columns: Columns, path: Path) -> Path:
    """A CSV table of columns."""
    rows: Sequence[tuple[float, ...]] = list(zip(*(values.tolist() for values in columns.values()), strict=True))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(rows)
    return path
