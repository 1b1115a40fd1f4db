"""The workflow files cannot run here; what can be known of them without running is whether they name what exists."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from station.__main__ import main

ROOT = Path(__file__).parents[2]
FILES = sorted((ROOT / ".github/workflows").glob("*.yml"))
SYSTEMS = {"ubuntu-latest", "ubuntu-24.04-arm", "macos-latest", "windows-latest"}


def read(file: Path) -> dict[str, Any]:
    return YAML(typ="safe").load(file.read_text(encoding="utf-8"))


def lines_of(file: Path) -> list[str]:
    """Every command of a workflow, one in a line."""
    steps = [step for job in read(file)["jobs"].values() for step in job["steps"]]
    return [line for step in steps for line in step.get("run", "").splitlines() if line.strip()]


def test_the_station_is_tried_on_every_system_and_two_pythons() -> None:
    matrix = read(ROOT / ".github/workflows/systems.yml")["jobs"]["station"]["strategy"]["matrix"]
    assert set(matrix["system"]) == SYSTEMS
    assert matrix["python"] == ["3.11", "3.13"]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_every_job_says_where_it_runs_and_every_step_does_one_thing(file: Path) -> None:
    for job in read(file)["jobs"].values():
        assert job["runs-on"]
        for step in job["steps"]:
            assert ("run" in step) != ("uses" in step)
            assert re.fullmatch(r"[\w-]+/[\w-]+@v\d+", step.get("uses", "actions/checkout@v4"))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_every_command_and_every_path_exists(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for line in lines_of(file):
        words = shlex.split(line)
        if words[0] == "station":
            options = [word for word in words[2:] if word.startswith("--")]
            with pytest.raises(SystemExit) as ended:
                main([words[1], "--help"])
            assert ended.value.code == 0
            printed = capsys.readouterr().out
            assert [option for option in options if option not in printed] == []
        else:
            assert words[:3] in (["python", "-m", "pip"], ["python", "-m", "pytest"])
        assert [word for word in words if word.startswith("tests/") and not (ROOT / word).exists()] == []
