"""The generator through MuJoCo has laws of its own: it knows neither the tool nor the tool's physics."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.unit.concealed.test_independence import ROOT, imported

FORBIDDEN = ("station.physics", "station.diagnosis", "tests.proof", "station.simulators.planar")
SOURCES = sorted((ROOT / "tests" / "frames").rglob("*.py"))


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.name)
def test_no_source_imports_the_tool_or_its_physics(path: Path):
    assert not [name for name in imported(path) if name.startswith(FORBIDDEN)]


def test_nothing_of_them_is_loaded_at_run_time_either():
    script = (
        "import sys, tests.frames.__main__, pi_agent.lockstep\n"
        f"print([name for name in sys.modules if name.startswith({FORBIDDEN!r})])"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
