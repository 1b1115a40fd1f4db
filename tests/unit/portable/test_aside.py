"""A command that runs aside has a low priority in a session of its own, its status, and Ctrl-C."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.aside import NICE, SHARE_OF_SESSION
from tests.patience import PATIENCE_S

ROOT = Path(__file__).parents[3]
ASIDE = [sys.executable, "-m", "tests.aside", sys.executable, "-c"]
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no sessions of processes")


def test_it_yields_and_gives_the_status() -> None:
    told = "import os; print(os.getpriority(os.PRIO_PROCESS, 0), os.getsid(0) == os.getpid()); raise SystemExit(7)"
    done = subprocess.run([*ASIDE, told], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.stdout.split() == [str(min(19, os.getpriority(os.PRIO_PROCESS, 0) + NICE)), "True"]
    assert done.returncode == 7


@pytest.mark.skipif(not SHARE_OF_SESSION.exists(), reason="this kernel gives sessions no shares")
def test_the_whole_session_yields() -> None:
    told = "print(open('/proc/self/autogroup', encoding='ascii').read())"
    done = subprocess.run([*ASIDE, told], cwd=ROOT, capture_output=True, text=True, check=True)
    assert f"nice {NICE}" in done.stdout or not done.stdout.strip()


def test_ctrl_c_ends_it(tmp_path: Path) -> None:
    begun = tmp_path / "begun"
    process = subprocess.Popen(
        [*ASIDE, f"import pathlib, time; pathlib.Path({str(begun)!r}).touch(); time.sleep(600)"], cwd=ROOT
    )
    end = time.monotonic() + PATIENCE_S
    while not begun.exists():
        assert time.monotonic() < end
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    assert process.wait(PATIENCE_S) != 0
