"""Cross products and columns are NumPy's, bit by bit, in all shapes that go together."""

from __future__ import annotations

import numpy as np
import pytest

from shared.vectors import columns, cross


@pytest.mark.parametrize(("first", "second"), [((3,), (3,)), ((7, 3), (3,)), ((3,), (7, 3)), ((2, 7, 3), (2, 7, 3))])
def test_it_is_numpys_cross_product(first: tuple[int, ...], second: tuple[int, ...]) -> None:
    rng = np.random.default_rng(1)
    a, b = rng.standard_normal(first), rng.standard_normal(second)
    assert np.array_equal(cross(a, b), np.cross(a, b))


@pytest.mark.parametrize(("rows", "count"), [(0, 2), (1, 1), (7, 3)])
def test_columns_are_numpys(rows: int, count: int) -> None:
    parts = np.random.default_rng(1).standard_normal((count, rows))
    found = columns(*parts)
    assert found.flags.c_contiguous
    assert np.array_equal(found, np.column_stack(list(parts)))
