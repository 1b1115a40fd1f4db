"""Runs a command with what the processor has left: `python -m tests.aside COMMAND …`.

`nice` alone does not do that where Linux gives each session of processes an equal share (sched_autogroup): beside a
session that computes, one whose processes have clocks of their own got 0.8 ms in 2 s. So the command gets a session of
its own, with a small share for the whole of it; Ctrl-C, which a terminal sends to its own session, is passed on.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from types import FrameType

NICE = 10
"""A niceness of 10 of 19 gives a tenth of an ordinary process's share; `nice` itself takes this if nothing is said."""
SHARE_OF_SESSION = Path("/proc/self/autogroup")


def run(words: Sequence[str]) -> int:
    """Runs a command to its end; its exit status."""
    process = subprocess.Popen([sys.executable, "-m", "tests.aside", "--here", *words], start_new_session=True)

    def pass_on(number: int, _: FrameType | None) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, number)

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, pass_on)
    status = process.wait()
    return status if status >= 0 else 128 - status


def become(words: Sequence[str]) -> None:
    """Turns this process, the first of its session, into the command."""
    with contextlib.suppress(OSError):  # other kernels have no such shares
        SHARE_OF_SESSION.write_text(str(NICE), encoding="ascii")
    os.nice(NICE)
    os.execvp(words[0], list(words))


if __name__ == "__main__":
    if sys.argv[1] == "--here":
        become(sys.argv[2:])
    sys.exit(run(sys.argv[1:]))
