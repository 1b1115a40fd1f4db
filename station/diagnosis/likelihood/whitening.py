# ruff: noqa: PLR0917 (compiled functions take no keyword-only arguments)
"""Turns residuals and their slopes into independent components of unit scale, block by block of alike runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from station.compiled import compiled
from station.diagnosis.likelihood.noise import Noise
from station.diagnosis.likelihood.wander import Wander
from station.diagnosis.observations.channel import ONSET, Channel
from station.diagnosis.observations.evidence import Evidence
from station.physics.contact import Array, Bools

Index = np.ndarray[tuple[int], np.dtype[np.int64]]

PART_ROWS = 2048
"""The number of rows that are whitened at a time where all columns would be large: 550 of them then take 9 MB."""


class Whitening:
    """Whitens arrays (rows, …) in the stacked order of the evidence's channels.

    `run`, `channel` (rows,) are each component's run and channel, `block` (rows,) the first run of its group; `limit`
    (rows,) marks the censored ones. `unread` (rows,) is the share of each row's variance, given those before it in its
    block, that is not the error of its reading. `log_scale` (runs,) is each run's share of the log of its block's
    Cholesky determinant, which a log density subtracts.
    """

    def __init__(self, evidence: Evidence, noise: Noise, *, shaking: Array | None = None) -> None:
        self.run: Index = np.concatenate([channel.rows.run for channel in evidence.channels])
        self.channel: Index = np.concatenate(
            [np.full(len(channel), index, dtype=np.int64) for index, channel in enumerate(evidence.channels)]
        )
        self.limit: Bools = np.concatenate([channel.rows.limit for channel in evidence.channels])
        self.tail: Array = np.concatenate([noise.tails_of(channel) for channel in evidence.channels])
        reading = np.concatenate([noise.of_reading(channel) for channel in evidence.channels])
        own_of_rows = [noise.own[one.name] ** 2 * _is_of_rows(evidence, one) for one in evidence.channels]
        variance = reading + np.array(own_of_rows)[self.channel]
        if shaking is not None:
            variance[: len(shaking)] += shaking**2
        shared, own = _loads(evidence, noise, self.channel)
        wandering = _wandering(evidence, noise)
        self.block: Index = evidence.block[self.run]
        self._order = np.argsort(self.block, kind="stable")
        self._edges = np.searchsorted(self.block[self._order], np.arange(evidence.runs + 1))
        sizes = np.diff(self._edges)
        self._factors = np.zeros(int((sizes**2).sum()))
        self._factor_begins = np.concatenate([[0], np.cumsum(sizes**2)])
        rows = np.column_stack([variance, shared, own, self.channel, wandering])[self._order]
        log_size, self._begins = np.zeros(len(self.run)), np.zeros(len(self.run), dtype=np.int64)
        _factorise(rows, self._edges, self._factor_begins, self._factors, self._begins, log_size)
        self.unread: Array = np.empty(len(self.run))
        self.unread[self._order] = 1.0 - reading[self._order] * np.exp(-2.0 * log_size)
        self.log_scale: Array = np.bincount(self.run[self._order], log_size, evidence.runs).astype(np.float64)

    def __call__(self, values: Array) -> Array:
        """Returns whitened values; a vector (rows,) or a matrix (rows, columns)."""
        # A vector is one column; a matrix may have none, where there is nothing to fit.
        columns = np.ascontiguousarray(values[:, None] if values.ndim == 1 else values, dtype=np.float64)
        white = np.empty_like(columns)
        _solve(self._order, self._edges, self._factor_begins, self._factors, self._begins, columns, white)
        return white.reshape(values.shape)

    def parts(self, most: int = PART_ROWS) -> Iterator[tuple[Index, Callable[[Array], Array]]]:
        """Yields all rows in parts of whole blocks, of about `most` rows, and what whitens values (m, columns)."""
        begins = np.searchsorted(self._edges, np.arange(0, len(self.run), most), side="right") - 1
        for first, last in pairwise([*np.unique(begins).tolist(), len(self._edges) - 1]):
            yield self._order[self._edges[first] : self._edges[last]], partial(self._part, first, last)

    def _part(self, first: int, last: int, values: Array) -> Array:
        """Whitens the values (m, columns) of the rows of the blocks from `first` to before `last`, in their order."""
        edges = self._edges[first : last + 1] - self._edges[first]
        begins = self._begins[self._edges[first] : self._edges[last]]
        white = np.empty_like(values)
        _solve(
            np.arange(len(values)),
            edges,
            self._factor_begins[first : last + 1],
            self._factors,
            begins,
            values,
            white,
        )
        return white


@compiled
def _factorise(rows: Any, edges: Any, places: Any, factors: Any, begins: Any, log_size: Any) -> None:
    """Writes the Cholesky factors of all blocks' covariances to `factors`, and their diagonals' logs to `log_size`.

    `rows` (rows, 8) are, block by block, the variance, the loads of the shared friction and of the channel's random
    effect, the channel, the place along the path, and the wander's standard deviation, reach and smoothness. In its
    block a row has no covariance with those before `begins` (rows,), which are written, too, and so none of their
    factors (an envelope: George & Liu 1981, Computer Solution of Large Sparse Positive Definite Systems, ch. 4).
    """
    for run in range(len(edges) - 1):
        block = rows[edges[run] : edges[run + 1]]
        size = len(block)
        factor = factors[places[run] : places[run + 1]].reshape(size, size)
        begin = begins[edges[run] : edges[run + 1]]
        for i in range(size):
            begin[i] = i
            for j in range(i):
                if block[i, 3] == block[j, 3] or (block[i, 1] != 0.0 and block[j, 1] != 0.0):
                    begin[i] = j
                    break
            for j in range(begin[i], i + 1):
                a, b = block[i], block[j]
                total = a[1] * b[1] + (a[0] if i == j else 0.0)
                if a[3] == b[3]:
                    total += a[2] * b[2]
                    if a[5] > 0.0:
                        apart = abs(a[4] - b[4]) / a[6]
                        total += a[5] ** 2 * np.exp(-apart) * (1.0 + a[7] * apart)
                for k in range(max(begin[i], begin[j]), j):
                    total -= factor[i, k] * factor[j, k]
                factor[i, j] = np.sqrt(total) if i == j else total / factor[j, j]
            log_size[edges[run] + i] = np.log(factor[i, i])


@compiled
def _solve(order: Any, edges: Any, places: Any, factors: Any, begins: Any, values: Any, white: Any) -> None:
    """Solves by forward substitution, run by run, for all columns at once; see `_factorise`."""
    for run in range(len(edges) - 1):
        rows, begin = order[edges[run] : edges[run + 1]], begins[edges[run] : edges[run + 1]]
        size = len(rows)
        factor = factors[places[run] : places[run + 1]].reshape(size, size)
        for i in range(size):
            for c in range(values.shape[1]):
                white[rows[i], c] = values[rows[i], c]
            for k in range(begin[i], i):
                if factor[i, k] != 0.0:
                    for c in range(values.shape[1]):
                        white[rows[i], c] -= factor[i, k] * white[rows[k], c]
            for c in range(values.shape[1]):
                white[rows[i], c] /= factor[i, i]


def _loads(evidence: Evidence, noise: Noise, channel: Index) -> tuple[Array, Array]:
    """Returns loadings (rows,) of the shared friction of a block, and of its channel's random effect of it."""
    shared, own = np.zeros(len(channel)), np.zeros(len(channel))
    for index, one in enumerate(evidence.channels):
        of_channel = channel == index
        if one.shares_friction:
            shared[of_channel] = noise.friction
        if evidence.group is not None:
            own[of_channel] = noise.group[one.name]
        elif not _is_of_rows(evidence, one):
            own[of_channel] = noise.own[one.name]
    return shared, own


def _is_of_rows(evidence: Evidence, channel: Channel) -> bool:
    """Returns true if a channel's random effect of a run is in the variance of its rows.

    A run has one onset, or one row.
    """
    return channel.name == ONSET or evidence.group is not None


def _wandering(evidence: Evidence, noise: Noise) -> Array:
    """Returns the place along the path, and the wander's standard deviation, reach and smoothness (rows, 4).

    They are 0, 0, 1, 0 where there is none.
    """
    found = list[Array]()
    for channel in evidence.channels:
        wander = noise.wander.get(channel.name, Wander(0.0, 1.0))
        place = np.zeros(len(channel)) if channel.travelled_m is None else channel.travelled_m
        numbers = np.array([wander.sd, wander.reach_m, wander.smooth])
        found.append(np.column_stack([place, np.broadcast_to(numbers, (len(channel), 3))]))
    return np.concatenate(found)


def stack(evidence: Evidence, parts: Mapping[str, Array]) -> Array:
    """Returns values by channel, one below the other in the evidence's order: (rows, …)."""
    ordered: Sequence[Array] = [parts[channel.name] for channel in evidence.channels]
    return np.concatenate(ordered) if ordered else np.zeros(0)
