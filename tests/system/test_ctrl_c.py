"""Ctrl-C, sent to a real process, gives the exit status that the help of its command tells."""

from __future__ import annotations

import re
import signal
import subprocess
from pathlib import Path

import pytest

from tests.patience import PATIENCE_S
from tests.system.processes import CALM_HZ, end, rig_file, start

pytestmark = pytest.mark.system


def told(*words: str) -> int:
    """The status of Ctrl-C in a command's help, once the command has begun."""
    said = start(*words, "--help").communicate(timeout=PATIENCE_S)[0]
    found = re.search(r"130: stopped by Ctrl-C(?:, but (\d))?", " ".join(said.split()))
    assert found, said
    return int(found[1] or 130)


def stopped(process: subprocess.Popen[str], *, at: str) -> int:
    """The status of a process that gets Ctrl-C when it has printed these words."""
    assert process.stdout is not None
    try:
        assert any(at in line for line in process.stdout), "it ended before"
        process.send_signal(signal.SIGINT)
        said, _ = process.communicate(timeout=PATIENCE_S)
    finally:
        end(process)
    assert "Traceback" not in said
    return process.returncode


@pytest.mark.parametrize(
    ("command", "options", "at", "status"),
    [
        ("serve", ("--port", "0", "--no-browser"), "Ctrl-C ends it", 0),
        ("twin", (), "is on the bus", 0),
        ("arm", (), "is on the bus", 0),
        ("record", ("--out", "bus.mcap"), "Ctrl-C ends it", 0),
    ],
)
def test_a_command_that_serves(tmp_path: Path, command: str, options: tuple[str, ...], at: str, status: int):
    out = [str(tmp_path / word) if word.endswith(".mcap") else word for word in options]
    process = start("station", command, "--rig", str(rig_file(tmp_path, rate_hz=CALM_HZ)), *out)
    assert stopped(process, at=at) == told("station", command) == status


def test_a_command_that_computes(tmp_path: Path):
    process = start("station", "demo", "--seed", "1", "--samples", "60", "--out", str(tmp_path))
    assert stopped(process, at="Sealed:") == told("station", "demo") == 130


def test_a_command_that_computes_a_session(tmp_path: Path):
    """The session has begun, and ends early with the table of what was simulated until then."""
    words = ("--lockstep", "--samples", "9999", "--seed", "1", "--out", str(tmp_path / "session.mcap"))
    assert stopped(start("station", "run", *words), at="samples in") == told("station", "run") == 1
