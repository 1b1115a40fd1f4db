"""The generator knows nothing of what has to find the effects."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
FORBIDDEN = ("station.physics", "station.diagnosis", "station.simulators", "mujoco", "pi_agent")
ALLOWED_OF_STATION = ("station.recording", "station.friction.onset", "station.pool")
SOURCES = sorted((ROOT / "tests" / "concealed").rglob("*.py"))


def imported(path: Path) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: write imports out, so that this test can read them"
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.name)
def test_no_source_imports_the_tools_physics(path: Path):
    names = imported(path)
    assert not [name for name in names if name.startswith(FORBIDDEN)]
    station = [name for name in names if name.startswith("station")]
    assert all(name.startswith(ALLOWED_OF_STATION) for name in station), station


def test_nothing_of_it_is_loaded_at_run_time_either():
    script = (
        f"import sys, tests.concealed.__main__\nprint([name for name in sys.modules if name.startswith({FORBIDDEN!r})])"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_tool_does_not_know_the_generator():
    for package in ("station", "shared", "pi_agent"):
        for path in (ROOT / package).rglob("*.py"):
            assert "tests.concealed" not in imported_or_nothing(path), path


def imported_or_nothing(path: Path) -> str:
    return " ".join(
        line for line in path.read_text(encoding="utf-8").splitlines() if line.lstrip().startswith(("import ", "from "))
    )
