"""Machine code that is kept is that of the sources as they are now, wherever it is kept."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
CALLEE = """\
from station.compiled import compiled
FACTOR = {factor}
@compiled
def times(value):
    return FACTOR * value
"""
CALLER = """\
from callee import FACTOR, times
from station.compiled import compiled
@compiled
def both(value):
    return times(value) + FACTOR
print(both(1.0), sum(both.stats.cache_hits.values()))
"""


def beside_the_source(folder: Path) -> dict[str, str]:
    return {"XDG_CACHE_HOME": str(folder / "nowhere")}


def where_the_user_says(folder: Path) -> dict[str, str]:
    return {"NUMBA_CACHE_DIR": str(folder / "asked")}


def in_the_users_cache(folder: Path) -> dict[str, str]:
    """A file in the place of the folder beside the source stands for one that cannot be written."""
    (folder / "__pycache__").touch()
    return {"XDG_CACHE_HOME": str(folder / "cache"), "HOME": str(folder)}


def said(folder: Path, words: dict[str, str], *, factor: float) -> list[str]:
    (folder / "callee.py").write_text(CALLEE.format(factor=factor), encoding="utf-8")
    clean = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    # Bytecode is taken for that of a source of the same size that was written in the same second.
    environment = {**clean, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1", **words}
    command = [sys.executable, "caller.py"]
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=True
    ).stdout.split()


@pytest.mark.parametrize("kept", [beside_the_source, where_the_user_says, in_the_users_cache])
def test_what_another_file_changes_is_compiled_anew(tmp_path: Path, kept: Callable[[Path], dict[str, str]]) -> None:
    (tmp_path / "caller.py").write_text(CALLER, encoding="utf-8")
    words = kept(tmp_path)
    assert said(tmp_path, words, factor=2.0) == ["4.0", "0"]
    assert said(tmp_path, words, factor=2.0) == ["4.0", "1"], "what is kept was not used"
    assert said(tmp_path, words, factor=3.0) == ["6.0", "0"]
