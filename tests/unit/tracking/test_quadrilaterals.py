"""Candidates for the mark are looked for among what the picture can hold, whatever size is asked for."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pi_agent.tracking.quadrilaterals import candidates

SIDE_PX = 40


@pytest.fixture
def square() -> NDArray[np.uint8]:
    """A dark square in a bright picture."""
    frame = np.full((120, 160), 200, dtype=np.uint8)
    frame[30 : 30 + SIDE_PX, 50 : 50 + SIDE_PX] = 20
    return frame


@pytest.mark.parametrize("largest_px", [60.0, 1e4, 1e9, 1e18])
@pytest.mark.parametrize("aspect", [1.0, 1.2])
def test_a_mark_is_found_however_large_it_might_be(square: NDArray[np.uint8], largest_px: float, aspect: float) -> None:
    found = candidates(square, side_px=(30.0, largest_px), aspect=aspect)
    assert len(found) == 1
    np.testing.assert_allclose(found[0].mean(), 69.5 + 49.5j, atol=1.0)


@pytest.mark.parametrize(("least_px", "aspect"), [(1e9, 1.0), (1e18, 1.0), (30.0, 1e9), (1e9, 1e-9)])
def test_a_mark_larger_than_the_picture_is_not_found(square: NDArray[np.uint8], least_px: float, aspect: float) -> None:
    assert candidates(square, side_px=(least_px, 2.0 * least_px), aspect=aspect) == []
