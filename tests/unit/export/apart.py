"""Runs exported files in a Python of their own, in an empty folder, where this package cannot be imported."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from station.export.exported import ExportedFile

WITHOUT_US = """
import sys

class Nothing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("station", "shared", "pi_agent", "tests", "repose_user_effects"):
            raise ImportError(f"an exported file may not need {name}")

sys.meta_path.insert(0, Nothing())
sys.path[:0] = [""]
"""


def apart(folder: Path, files: Sequence[ExportedFile], script: str) -> str:
    """Returns what the script prints in the folder with these files; it fails if the script does."""
    for file in files:
        (folder / file.name).write_text(file.text, encoding="utf-8")
    words = [sys.executable, "-I", "-W", "error", "-c", WITHOUT_US + script]
    done = subprocess.run(words, cwd=folder, capture_output=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout
