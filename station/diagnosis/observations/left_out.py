"""The reasons why runs of a session are left out of the evidence of friction."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from station.diagnosis.observations.channel import Channel
from station.diagnosis.observations.starts import leans
from station.diagnosis.observations.tracks import RunTrack

if TYPE_CHECKING:
    from station.diagnosis.observations.build import Recorded

NO_EVENTS = "had no events or no attitude around their onset"
LEANED = "leaned on the foam"
HELD = "did not slide"
TOO_SHORT = "slid too little to be measured"


def left_out(recorded: Recorded, channels: Sequence[Channel]) -> Mapping[str, int]:
    """Returns the number of runs without a row of friction by the reason, a verb with the runs as its subject."""
    used = {int(run) for channel in channels if channel.shares_friction for run in channel.rows.run}
    counts = Counter({NO_EVENTS: len(recorded.signals.samples) - len(recorded.tracks)})
    for run, track in enumerate(recorded.tracks):
        if run not in used:
            counts[_reason(track, recorded)] += 1
    return {reason: count for reason, count in counts.items() if count}


def _reason(track: RunTrack, recorded: Recorded) -> str:
    if leans(track, recorded.setting):
        return LEANED
    return TOO_SHORT if track.slid else HELD
