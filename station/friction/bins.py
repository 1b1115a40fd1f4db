"""Means over bins: along a direction (Fig. 7) and over the image (Fig. 8)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from station.friction.direction import Array

BINS = 32
PATCH_PX = 10


@dataclass(frozen=True, eq=False)
class Bins:
    """Values in bins (k,): middle (rad), number, mean and standard deviation (NaN below 1 and 2 values)."""

    middle_rad: Array
    count: NDArray[np.int64]
    mean: Array
    sd: Array


def by_direction(direction_rad: Array, values: Array, *, span_rad: float = math.pi, bins: int = BINS) -> Bins:
    """Gives mean and standard deviation (bins,) of `values` (n,) by `direction_rad` (n,), in equal parts of [0, span).

    The values keep their unit.
    """
    known = np.isfinite(direction_rad) & np.isfinite(values)
    bin_index = np.minimum((direction_rad[known] % span_rad / span_rad * bins).astype(np.int64), bins - 1)
    count = np.bincount(bin_index, minlength=bins)
    total = np.bincount(bin_index, weights=values[known], minlength=bins)
    mean = np.divide(total, count, out=np.full(bins, np.nan), where=count > 0)
    squares = np.bincount(bin_index, weights=(values[known] - mean[bin_index]) ** 2, minlength=bins)
    sd = np.sqrt(np.divide(squares, count - 1, out=np.full(bins, np.nan), where=count > 1))
    return Bins(middle_rad=(np.arange(bins) + 0.5) * span_rad / bins, count=count, mean=mean, sd=sd)


def heat_map(centre_px: Array, values: Array, *, size_px: tuple[int, int], patch_px: int = PATCH_PX) -> Array:
    """Returns the mean of the values in patches of the image, (rows, columns); NaN where there is none.

    Args:
        centre_px: (n, 2) places in the image, px.
        values: (n,) what is averaged, in any unit.
        size_px: width and height of the image, px.
        patch_px: side of a patch, px.
    """
    columns, rows = (math.ceil(size / patch_px) for size in size_px)
    # The image begins half a pixel before the centre of its first one.
    patch = np.floor((centre_px + 0.5) / patch_px)
    inside = np.isfinite(patch).all(axis=1) & (patch >= 0).all(axis=1) & (patch < [columns, rows]).all(axis=1)
    index = (patch[inside, 1] * columns + patch[inside, 0]).astype(np.int64)
    count = np.bincount(index, minlength=rows * columns)
    total = np.bincount(index, weights=values[inside], minlength=rows * columns)
    mean = np.divide(total, count, out=np.full(rows * columns, np.nan), where=count > 0)
    return mean.reshape(rows, columns)
