"""Machine code that is kept is that of the sources as they are now."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

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


def said(folder: Path, *, factor: float) -> str:
    (folder / "callee.py").write_text(CALLEE.format(factor=factor), encoding="utf-8")
    command, environment = [sys.executable, "caller.py"], {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=True).stdout


def test_what_another_file_changes_is_compiled_anew(tmp_path: Path) -> None:
    (tmp_path / "caller.py").write_text(CALLER, encoding="utf-8")
    assert said(tmp_path, factor=2.0).split() == ["4.0", "0"]
    assert said(tmp_path, factor=2.0).split() == ["4.0", "1"], "what is kept was not used"
    assert said(tmp_path, factor=3.0).split() == ["6.0", "0"]
