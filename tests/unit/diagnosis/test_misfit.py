"""A law leaves a part to others by not being nature's."""

import pytest

from station.diagnosis.search.misfit import temperature
from station.diagnosis.thresholds import KNOWN_TO


def test_differences_of_strong_laws_count_less() -> None:
    assert temperature([]) == 1.0
    assert temperature([KNOWN_TO, 3.0 * KNOWN_TO]) == pytest.approx(4.0)
