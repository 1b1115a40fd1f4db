"""The camera agent's clock steps or drifts in the middle of a run."""

from __future__ import annotations

import time
from functools import partial
from random import Random

from tests.faults.lab import Lab
from tests.faults.row import Row


def clock(what: dict[str, float], lab: Lab, _random: Random) -> None:
    """For twenty seconds; then it is right again, which is another step."""
    lab.sabotage("camera", **what)
    time.sleep(20.0)
    lab.sabotage("camera")


ROWS = (
    Row("camera's clock steps by +2 s", partial(clock, {"step_s": 2.0}), blind=False),
    Row("camera's clock steps by -2 s", partial(clock, {"step_s": -2.0}), blind=False),
    Row("camera's clock drifts by 500 ppm", partial(clock, {"drift": 5e-4}), blind=False),
)
