"""A rig file names a tag, and one inside a recording names any."""

from __future__ import annotations

import pytest

from pi_agent.tracking.mark import tag_bits
from shared.errors import UserError


@pytest.mark.parametrize("number", [-1, 30, 10**18])
def test_a_tag_that_its_dictionary_lacks_is_refused(number: int) -> None:
    with pytest.raises(UserError, match=f"which has 0 to 29, got {number}"):
        tag_bits("APRILTAG_16h5", number)


def test_a_dictionary_that_opencv_lacks_is_refused() -> None:
    with pytest.raises(UserError, match=r"name of an OpenCV dictionary of tags .* got 'NONSENSE'"):
        tag_bits("NONSENSE", 0)


def test_a_tag_has_its_bits() -> None:
    assert tag_bits("APRILTAG_16h5", 29).shape == (4, 4)
