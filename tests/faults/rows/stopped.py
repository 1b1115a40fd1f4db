"""SIGSTOP of each process for 2, 10, 40 and 120 s: a machine that swaps, a laptop that sleeps."""

from __future__ import annotations

import signal
import time
from functools import partial
from random import Random

from tests.faults.lab import Lab
from tests.faults.row import Row


def stop(name: str, for_s: float, lab: Lab, _random: Random) -> None:
    """Stops a process and lets it go on."""
    lab.signal(name, signal.SIGSTOP)
    time.sleep(for_s)
    lab.signal(name, signal.SIGCONT)


ROWS = tuple(
    Row(f"SIGSTOP {name} {for_s} s", partial(stop, name, for_s), blind=name != "twin")
    for for_s in (2, 10, 40, 120)
    for name in ("camera", "arm", "station", "twin")
)
