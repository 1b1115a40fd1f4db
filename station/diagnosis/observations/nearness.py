"""A resting block's nearness to its limit, and the creep there, whose reasons nobody tells.

A block within a few per cent of its limit moves before it gets away: contacts yield one after another (Dahl 1968),
friction that grows with the speed lets it creep (Marone 1998, Annu. Rev. Earth Planet. Sci. 26, 643), a push that does
not last slides it by a little (Newmark 1965), and its limit itself is known to a per cent or two. All of this grows by
e-folds towards the limit, and none of it says which of them it is. At the limit itself a block goes on until friction
changes under it, over the shortest way in which it does. Farther below, a block that creeps says more.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from station.diagnosis import thresholds
from station.diagnosis.observations.driving import driving
from station.diagnosis.observations.plate import PlateMotion, Times
from station.diagnosis.observations.starts import starts
from station.diagnosis.observations.stretches import Stretches
from station.diagnosis.observations.tracks import RunTrack
from station.physics.contact import Array
from station.physics.turning import turned_push

if TYPE_CHECKING:
    from station.diagnosis.observations.build import Recorded

PITCH_NS = 4_000_000
"""The loads are looked at so often: an arm's ringing takes tens of milliseconds."""


def crept_m(recorded: Recorded, stretches: Stretches) -> Array:
    """Returns the way (n,), m, that blocks may have crept, on the mean over stretches (n,) of their tilts."""
    found, runs = np.zeros(len(stretches)), stretches["run"]
    for run in np.unique(runs):
        time_ns, share = nearness(recorded.tracks[run], recorded.slipping, recorded.reread.arm_m)
        crept = thresholds.SHORTEST_REACH_M * np.exp((share - 1.0) / thresholds.CREPT_SHARE)
        total, rows = np.append(0.0, np.cumsum(crept)), runs == run
        first = np.minimum(np.searchsorted(time_ns, stretches["from_ns"][rows]), len(time_ns) - 1)
        last = np.clip(np.searchsorted(time_ns, stretches["to_ns"][rows]), first + 1, len(time_ns))
        found[rows] = (total[last] - total[first]) / (last - first)
    return found


def nearness(track: RunTrack, plate: PlateMotion, arm_m: Array) -> tuple[Times, Array]:
    """Returns moments (m,), ns, of a tilt until the slip, and the largest share (m,) of its limit loaded so far.

    The limit is the largest load until the slip. `arm_m` (3,), m in P, is from the true pivot to the configured one.
    """
    time_ns = np.arange(track.tilt_ns, max(track.slip_ns, track.tilt_ns + 1), PITCH_NS)
    place_m = np.broadcast_to(starts([track])[:, :2], (len(time_ns), 2))
    at = plate.at(time_ns)
    load = driving(at, place_m, np.zeros_like(place_m))
    load = load + turned_push(at.acceleration_rad_s2, at.rate_rad_s, arm_m)
    highest = np.maximum.accumulate(np.hypot(load[:, 0], load[:, 1]) / -load[:, 2])
    return time_ns, highest / highest[-1]
