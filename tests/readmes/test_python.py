"""Every block of Python in every page runs as it stands, in a folder like the reader's, and prints what it promises."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.readmes.blocks import ROOT, Block, blocks
from tests.readmes.reader import furnish, write_twenty_runs

PRINTS = {
    "html_page": ["indistinguishable", "anisotropy cos2"],
    "station.diagnose(": ["No missing effect is supported", "Onsets of"],
    "station.analyze(": ["Angle of repose"],
}
"""The words that the files of the reader's folder make a block print; the other blocks print nothing."""

MAKES = {"station/diagnosis/README.md": "report.html"}

ONCE = """
from runpy import run_path
from pytest import MonkeyPatch
from tests.unit.diagnosis.asked_once import ask_once

ask_once(MonkeyPatch())
run_path("example.py", run_name="__main__")
"""
"""Runs a block in a Python of its own. The same recording is diagnosed on other pages, and once for all of them."""


@pytest.mark.parametrize("block", blocks("python"), ids=lambda block: block.readme)
def test_it_runs_as_it_stands(block: Block, tmp_path: Path) -> None:
    folder = furnish(tmp_path / "here")
    if "sim.mcap" in block.text:
        write_twenty_runs(folder / "sim.mcap")
    (folder / "example.py").write_text(block.text, encoding="utf-8")
    words = [sys.executable, "-W", "error", "-c", ONCE]
    of_this_checkout = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(words, cwd=folder, env=of_this_checkout, capture_output=True, encoding="utf-8", check=False)
    assert done.returncode == 0, done.stderr
    expected = [words for part, every in PRINTS.items() if part in block.text for words in every]
    assert all(words in done.stdout for words in expected), done.stdout
    assert bool(done.stdout) == bool(expected), f"PRINTS says nothing of this: {done.stdout}"
    assert (folder / MAKES.get(block.readme, "example.py")).stat().st_size > 0
