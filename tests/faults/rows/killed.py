"""kill -9 of each process; who starts it again is the system (the unit, a person), a few seconds later."""

from __future__ import annotations

import time
from functools import partial
from random import Random

from tests.faults.lab import Lab
from tests.faults.row import Row


def kill(name: str, lab: Lab, random: Random) -> None:
    """Kills a process and starts it again."""
    lab.kill(name)
    time.sleep(random.uniform(1.0, 4.0))
    lab.start(name)


def kill_station(lab: Lab, random: Random) -> None:
    """Nobody starts a session again by itself: the arm holds, then levels."""
    lab.kill("station")
    time.sleep(random.uniform(8.0, 10.0))


def power_cut(lab: Lab, random: Random) -> None:
    """The station's machine goes off: the process is gone, and the end of its file never reached the disk."""
    lab.kill("station")
    partial_file = lab.session_path.with_name(lab.session_path.name + ".partial")
    with partial_file.open("r+b") as file:
        size = file.seek(0, 2)
        file.truncate(max(0, size - random.randrange(100_000)))
    time.sleep(random.uniform(8.0, 10.0))


ROWS = (
    *(Row(f"kill -9 {name}, again after 1 to 4 s", partial(kill, name)) for name in ("camera", "arm", "twin")),
    Row("kill -9 station", kill_station, ends=True),
    Row("power cut of the recorder", power_cut, ends=True),
)
