"""The disk of the recordings is full. It is one of our own, which needs root."""

from __future__ import annotations

import contextlib
import time
from random import Random

from tests.faults.lab import Lab
from tests.faults.row import Row


def full(lab: Lab, _random: Random) -> None:
    """Another program fills it."""
    filler = lab.disk / "filler"
    with contextlib.suppress(OSError), filler.open("wb", buffering=0) as file:
        while file.write(bytes(1 << 20)) == 1 << 20:
            pass
    time.sleep(10.0)
    filler.unlink()


ROWS = (Row("disk full", full, ends=True, network=True),)
