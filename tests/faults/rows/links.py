"""The cable of each process: pulled, silent, losing 5 % of its frames, late by 200 ms."""

from __future__ import annotations

import time
from functools import partial
from random import Random

from tests.faults.lab import Lab
from tests.faults.row import Row


def cut(name: str, for_s: float, lab: Lab, _random: Random) -> None:
    """The plug is pulled and put in again."""
    assert lab.network is not None
    lab.network.cut(name)
    time.sleep(for_s)
    lab.network.mend(name)


def silence(name: str, for_s: float, lab: Lab, _random: Random) -> None:
    """The link is up and carries nothing."""
    assert lab.network is not None
    lab.network.silence(name)
    time.sleep(for_s)
    lab.network.speak(name)


def bad(name: str, loss: float, delay_s: float, lab: Lab, _random: Random) -> None:
    """Frames are lost or late for twenty seconds."""
    assert lab.network is not None
    lab.network.bad(name, loss=loss, delay_s=delay_s)
    time.sleep(20.0)
    lab.network.plain(name)


CABLES = ("camera", "arm", "station")
ROWS = (
    *(Row(f"{name}'s cable cut {s} s", partial(cut, name, s), network=True) for name in CABLES for s in (2, 10, 40)),
    *(Row(f"{name}'s cable silent 10 s", partial(silence, name, 10.0), network=True) for name in CABLES),
    *(
        Row(f"{name}'s cable loses 5 %, 20 s", partial(bad, name, 0.05, 0.0), blind=False, network=True)
        for name in CABLES
    ),
    *(
        Row(f"{name}'s cable 200 ms late, 20 s", partial(bad, name, 0.0, 0.2), blind=False, network=True)
        for name in CABLES
    ),
)
