"""The name of the distribution, and what a missing package's sentence says."""

from __future__ import annotations

import ast
import importlib.metadata
import sys
import tomllib
from pathlib import Path

import pytest

from shared import installed
from shared.installed import DISTRIBUTION, sentence_of, to_install

ROOT = Path(__file__).parents[3]
OURS = {"pi_agent", "station", "shared"}
# These come with an operating system, with ROS or with the checkout, and no extra can bring them.
ELSEWHERE = {
    "picamera2",
    "libcamera",
    "simplejpeg",
    "rospy",
    "actionlib",
    "actionlib_msgs",
    "genpy",
    "_ros1_messages",
} | {*("sensor_msgs", "std_msgs", "trajectory_msgs", "tests")}


def imported() -> set[str]:
    """The roots of all foreign modules that the three packages import, anywhere in a file."""
    found: set[str] = set()
    for path in (path for package in OURS for path in (ROOT / package).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                found.add(str(node.module).partition(".")[0])
    return found - OURS - set(sys.stdlib_module_names) - ELSEWHERE


def test_the_distribution_has_one_name():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["name"] == DISTRIBUTION
    assert installed.version() == project["version"]


def test_every_foreign_module_comes_with_a_requirement_that_its_absence_names():
    for module in sorted(imported()):
        sentence = sentence_of(ModuleNotFoundError(name=f"{module}.part"))
        assert sentence is not None, f"no requirement in pyproject.toml brings {module}"
        assert f'"{DISTRIBUTION}' in sentence
        assert "[all]" not in sentence


@pytest.mark.parametrize(
    ("module", "extra"),
    [("serial", "sensors"), ("rerun", "view"), ("mujoco", "station"), ("ssik", "arm")],
)
def test_the_extra_is_the_one_by_need(module: str, extra: str):
    assert f'"{DISTRIBUTION}[{extra}]"' in str(sentence_of(ModuleNotFoundError(name=module)))


def test_what_no_extra_brings_is_a_fault_and_no_users_mistake():
    assert sentence_of(ModuleNotFoundError(name="station.no_such_module")) is None


def test_without_an_installation_nothing_is_claimed(monkeypatch: pytest.MonkeyPatch):
    def missing(name: str) -> list[str]:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "requires", missing)
    monkeypatch.setattr(importlib.metadata, "version", missing)
    assert sentence_of(ModuleNotFoundError(name="mujoco")) is None
    assert installed.version() == "unknown"


@pytest.mark.parametrize(
    ("prefix", "command"),
    [
        ("/home/me/.venv", "pip install"),
        ("/home/me/.local/share/pipx/venvs/x", "pipx runpip"),
        ("/home/me/.local/share/uv/tools/x", "uv pip install --python"),
    ],
)
def test_the_command_is_that_of_the_program_that_made_the_environment(
    prefix: str, command: str, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(sys, "prefix", prefix)
    assert to_install("view").startswith(command)
    assert to_install("view").endswith(f'"{DISTRIBUTION}[view]"')
