"""The table of sizes: what it lacks, and what there is not, is one sentence before anything is installed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

SIZES = Path(__file__).parents[3] / "deploy" / "sizes.py"


def told(*words: str, path: Path) -> str:
    """Returns what it says on its way out, where programs are sought in this folder."""
    done = subprocess.run(
        [sys.executable, str(SIZES), *words], env={"PATH": str(path)}, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (1, "")
    return done.stderr


def test_without_uv_one_sentence_says_how_to_have_it(tmp_path: Path) -> None:
    assert told("station", path=tmp_path) == "Expected uv, which installs each extra, and found none: pip install uv\n"


@pytest.mark.skipif(sys.platform == "win32", reason="Windows tells a program by its name, and this one is a script")
def test_an_unknown_extra_is_named_beside_those_that_there_are(tmp_path: Path) -> None:
    uv = tmp_path / "uv"
    uv.write_text("#!/bin/sh\nexit 1\n", encoding="utf-8")
    uv.chmod(0o755)
    said = told("station", "sensor", path=tmp_path)
    assert said.startswith("Expected extras among station, view, ")
    assert said.endswith(" or dev, got sensor\n")
