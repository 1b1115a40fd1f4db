"""The camera gives pictures that show nothing: the same again, black, without the mark, half covered."""

from __future__ import annotations

import time
from functools import partial
from random import Random

from tests.faults.lab import Lab
from tests.faults.row import Row


def show(what: str, lab: Lab, _random: Random) -> None:
    """For ten seconds."""
    lab.sabotage("camera", camera=what)
    time.sleep(10.0)
    lab.sabotage("camera")


WORDS = {"frozen": "camera frozen", "black": "camera black", "gone": "mark gone", "covered": "mark covered by half"}
ROWS = tuple(Row(f"{words}, 10 s", partial(show, what)) for what, words in WORDS.items())
