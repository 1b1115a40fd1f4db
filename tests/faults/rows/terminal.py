"""The terminal of the session is closed."""

from __future__ import annotations

import signal
import time
from random import Random

from tests.faults.lab import Lab
from tests.faults.row import Row


def hang_up(lab: Lab, _random: Random) -> None:
    """SIGHUP, as a shell sends it."""
    lab.signal("station", signal.SIGHUP)
    time.sleep(8.0)


ROWS = (Row("SIGHUP of the session", hang_up, ends=True),)
