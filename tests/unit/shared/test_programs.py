"""A command that is printed to be copied into a shell is found there."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from shared.programs import OWN_FAULT, exit_status, how_to_call


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


def test_a_fault_of_the_program_is_no_finding_and_no_mistake(capsys: pytest.CaptureFixture[str]) -> None:
    def faulty() -> int:
        raise ZeroDivisionError("of ours")

    assert exit_status("station diagnose", faulty) == OWN_FAULT not in (0, 1, 2, 130)
    told = capsys.readouterr().err
    assert "in faulty" in told, "the traceback tells where"
    assert told.splitlines()[-1].startswith("station diagnose: this is a fault of the program")
