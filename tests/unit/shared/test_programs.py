"""A command that is printed to be copied into a shell is found there."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from shared.programs import how_to_call


def test_a_program_beside_this_python_is_called_by_its_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", str(tmp_path / "venv" / "bin" / "python"))
    monkeypatch.setenv("PATH", "")
    monkeypatch.chdir(tmp_path)
    assert how_to_call("station") == os.path.join("venv", "bin", "station")


def test_a_program_on_the_path_is_called_by_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "station"
    program.touch(mode=0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert how_to_call("station") == "station"
