"""Whoever started the rig is gone: nobody is left behind, the arm stands still, and the next start has free ports."""

from __future__ import annotations

import os
import pty
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator
from pathlib import Path

import pytest

from shared.geometry import tilt_of
from shared.messages import PlatformState
from station.recording.reader import open_recording
from tests.patience import PATIENCE_S
from tests.system.processes import CALM_HZ, LEVEL_RAD, ROOT, observer, rig_file, wait

pytestmark = pytest.mark.system
PLAN = "samples = 1\nfaults = 1000\n[tilt]\nsteps = 20\nrate_deg_s = 10.0\nadapt_after = 0\n"
"""A machine with ten busy programs reports joints too late, and the arm's gate ends run after run."""
IN_ITS_TERMINAL = """\
import os, signal, sys
os.close(os.open(os.ttyname(0), os.O_RDWR))
signal.signal(signal.SIGHUP, signal.SIG_DFL)
os.execv(sys.argv[1], sys.argv[1:])
"""
"""Opening a terminal makes it that of a session that has none. Tests that run under nohup inherit an ignored SIGHUP."""


def processes_of(rig: Path) -> list[int]:
    """The ids of all processes that name this rig file."""
    found = subprocess.run(["pgrep", "-f", str(rig)], capture_output=True, text=True, check=False).stdout
    return [int(number) for number in found.split()]


def patiently(happened: Callable[[], bool]) -> None:
    limit = time.monotonic() + PATIENCE_S
    while not happened():
        assert time.monotonic() < limit, "it did not come to pass"
        time.sleep(0.1)


def tilted(rig: Path, process: subprocess.Popen[bytes]) -> None:
    """Waits until a session on the rig has tilted the plate."""
    seen = [0.0]
    with observer(rig) as bus:

        def take(message: PlatformState) -> None:
            seen.append(tilt_of(message.qw, message.qx, message.qy, message.qz))

        bus.subscribe("arm/platform", lambda received: take(received.message))  # pyright: ignore[reportArgumentType]
        wait(bus, lambda: seen[-1] > 0.1 or process.poll() is not None)
    assert process.poll() is None


@pytest.fixture
def rig(tmp_path: Path) -> Generator[Path]:
    """A rig file. Where a test fails, nobody of that rig is left to the tests that follow."""
    file = rig_file(tmp_path, rate_hz=CALM_HZ)
    yield file
    for process in processes_of(file):
        os.kill(process, signal.SIGKILL)


@pytest.mark.parametrize("end", ["killed", "terminal closed"])
def test_nobody_outlives_the_rig_that_started_it_and_the_next_start_works(rig: Path, tmp_path: Path, end: str):
    out, plan = tmp_path / "first.mcap", tmp_path / "plan.toml"
    plan.write_text(PLAN, encoding="utf-8")
    words = ["rig", "--rig", str(rig), "--plan", str(plan), "--no-view", "--samples"]
    command = [sys.executable, "-m", "station", *words]
    terminal, inside = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-c", IN_ITS_TERMINAL, *command, "50", "--out", str(out)],
        cwd=ROOT,
        stdin=inside,
        stdout=inside,
        stderr=inside,
        start_new_session=True,
    )
    os.close(inside)
    tilted(rig, process)
    if end == "killed":
        process.send_signal(signal.SIGKILL)
    os.close(terminal)  # the system tells the session so by SIGHUP
    process.wait(timeout=PATIENCE_S)
    patiently(lambda: not processes_of(rig))
    if end == "terminal closed":
        last = [item.message for item in open_recording(out).messages({"arm/platform"})][-1]
        assert isinstance(last, PlatformState)
        assert tilt_of(last.qw, last.qx, last.qy, last.qz) < LEVEL_RAD
    again = subprocess.run(
        [*command, "1", "--out", str(tmp_path / "second.mcap")],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert again.returncode == 0, again.stdout + again.stderr
    assert "Traceback" not in again.stdout + again.stderr
