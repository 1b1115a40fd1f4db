"""The arm does not do what it is told."""

from __future__ import annotations

import time
from random import Random

from tests.faults.lab import Lab
from tests.faults.row import Row


def deaf(lab: Lab, _random: Random) -> None:
    """Set-points do not reach the joints for ten seconds."""
    lab.sabotage("arm", arm="deaf")
    time.sleep(10.0)
    lab.sabotage("arm")


ROWS = (Row("arm stops following, 10 s", deaf),)
