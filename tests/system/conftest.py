"""Which tests of real processes may run side by side (`pytest -n 2 --dist loadgroup tests/system`).

A whole rig keeps a core busy, and two of them would cost each other frames: the files that start one follow each other.
Every other file is a group of its own, as its tests share what it has started.
"""

from __future__ import annotations

from pathlib import Path

import pytest

HERE = Path(__file__).parent
WHOLE_RIGS = {"test_rig.py", "test_live_faults.py", "test_orphans.py"}


@pytest.hookimpl(tryfirst=True)  # before xdist reads the groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.parent == HERE:
            name = "whole rig" if item.path.name in WHOLE_RIGS else item.path.stem
            item.add_marker(pytest.mark.xdist_group(name))
