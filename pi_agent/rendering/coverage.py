"""Exact area coverage of pixels by polygons, with a polygon of its own for every row.

Each edge is cut at the pixel borders; every piece adds its signed area to the pixel that it crosses and its height to
all pixels on its right (the accumulation of scan-line font rasterisers). The result is analytic, not sampled.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class _Pieces(NamedTuple):
    """Parts of edges inside one row: flat index of layer and row, x at both ends, signed height."""

    line: Integers
    left: Floats
    right: Floats
    height: Floats


def polygon_coverage(
    starts: Floats, ends: Floats, layer: Integers, *, layers: int, shape: tuple[int, int]
) -> NDArray[np.float32]:
    """Returns the fraction of each pixel covered, per layer: (layers, *shape), 0 to 1.

    Polygons of one layer must not overlap, run clockwise as seen (y down), and lie inside the patch in x.

    Args:
        starts: (r, edges, 2) where the directed edges begin in each of r rows, or in all of them for r = 1, px; the
            top-left pixel's corner is the origin.
        ends: (r, edges, 2) where they end, px.
        layer: (edges,) the layer of each edge.
        layers: the number of layers.
        shape: the patch's height and width, px.
    """
    pieces = _cut_at_rows(starts, ends, layer, rows=shape[0])
    return _accumulate(_cut_at_columns(pieces), layers=layers, shape=shape)


def _cut_at_rows(starts: Floats, ends: Floats, layer: Integers, *, rows: int) -> _Pieces:
    top = np.arange(rows, dtype=np.float64)[:, None]
    x0, y0, x1, y1 = starts[..., 0], starts[..., 1], ends[..., 0], ends[..., 1]
    from_y = np.clip(y0, top, top + 1.0)
    to_y = np.clip(y1, top, top + 1.0)
    row, edge = np.nonzero(from_y != to_y)
    source = row if len(x0) > 1 else np.zeros_like(row)
    y_start, x_start = y0[source, edge], x0[source, edge]
    slope = (x1[source, edge] - x_start) / (y1[source, edge] - y_start)
    a, b = from_y[row, edge], to_y[row, edge]
    xa, xb = x_start + (a - y_start) * slope, x_start + (b - y_start) * slope
    return _Pieces(layer[edge] * rows + row, np.minimum(xa, xb), np.maximum(xa, xb), a - b)


def _cut_at_columns(pieces: _Pieces) -> tuple[Integers, Integers, Floats, Floats]:
    """Gives the row line, column, signed height and mean x within the cell of every part of an edge in one pixel."""
    first = np.floor(pieces.left).astype(np.int64)
    count = np.floor(pieces.right).astype(np.int64) - first + 1
    piece = np.repeat(np.arange(len(first)), count)
    step = np.arange(len(piece)) - np.repeat(np.cumsum(count) - count, count)
    column = first[piece] + step
    left, right = pieces.left[piece], pieces.right[piece]
    cut_left, cut_right = np.maximum(left, column), np.minimum(right, column + 1)
    width = right - left
    share = np.divide(cut_right - cut_left, width, out=1.0 / count[piece], where=width > 1e-12)
    return pieces.line[piece], column, pieces.height[piece] * share, 0.5 * (cut_left + cut_right) - column


def _accumulate(
    parts: tuple[Integers, Integers, Floats, Floats], *, layers: int, shape: tuple[int, int]
) -> NDArray[np.float32]:
    line, column, height, inside = parts
    rows, columns = shape
    width = columns + 2  # a guard column keeps what lies beyond the patch from wrapping into the next row
    inside = np.where(column < 0, 0.0, inside)  # left of the patch: the first column is covered from its border on
    cell = line * width + np.clip(column, 0, columns)
    size = layers * rows * width
    beside, cells = height * inside, np.concatenate([cell, cell + 1])
    grid = np.bincount(cells, weights=np.concatenate([height - beside, beside]), minlength=size)
    sums = grid.reshape(layers, rows, width)
    np.cumsum(sums, axis=2, out=sums)
    covered = sums[:, :, :columns].astype(np.float32)
    return np.clip(covered, np.float32(0.0), np.float32(1.0), out=covered)
