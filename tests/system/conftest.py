"""Fixtures and the limit of the tests with processes of their own."""

from pathlib import Path

import pytest

from tests.patience import PATIENCE_S
from tests.system.live_rig import one_rig, rig

__all__ = ["one_rig", "rig"]

WAITS = 5
"""A test that waits for this many things in vain hangs, as far as pytest can know."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.timeout(WAITS * PATIENCE_S))
