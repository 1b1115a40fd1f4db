"""The first thing that a user does: a session of the simulated rig, diagnosed. Its camera's mount sags, and no more."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.readmes.blocks import blocks
from tests.readmes.numbers import without_numbers
from tests.recovery.rig_as_it_comes import rig_with, said_of

pytestmark = pytest.mark.timeout(900)

SEED = 40109
"""The session of the first page. `tests/benchmarks/test_rig_as_it_comes.py` has as many others as one asks for."""


def test_the_sag_is_found_alone(tmp_path: Path) -> None:
    said = said_of(rig_with(), seed=SEED, folder=tmp_path)
    assert list(said.claimed) == ["camera_sag"], said
    assert_as_on_the_first_page(said.printed)


def assert_as_on_the_first_page(printed: str) -> None:
    """The first page shows this session: the words are the same, numbers may differ in their last digits."""
    (shown,) = (one.text for one in blocks("text") if one.readme == "README.md" and one.is_diagnosis)
    assert all(without_numbers(part) in without_numbers(printed) for part in shown.split("…")), printed
    # The page ends as the command does: lines are left out where an ellipsis says so, and nowhere else.
    assert without_numbers(printed).endswith(without_numbers(shown.split("…")[-1])), printed
