"""The reasons why runs of a session are left out of the evidence of friction, or only their onsets are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from station.diagnosis.observations.channel import ONSET, Channel
from station.diagnosis.observations.starts import leans
from station.diagnosis.observations.tracks import RunTrack

if TYPE_CHECKING:
    from station.diagnosis.observations.build import Recorded

NO_EVENTS = "had no events or no attitude around their onset"
LEANED = "leaned on the foam"
HELD = "did not slide"
TOO_SHORT = "slid too little to be measured"
LEVEL = "slid on a plate that was hardly tilted"


def left_out(recorded: Recorded, channels: Sequence[Channel]) -> Mapping[str, int]:
    """Returns the number of runs without a row of friction by the reason, a verb with the runs as its subject."""
    used = _runs(channel for channel in channels if channel.shares_friction)
    counts = Counter({NO_EVENTS: len(recorded.signals.samples) - len(recorded.tracks)})
    for run, track in enumerate(recorded.tracks):
        if run not in used:
            counts[_reason(track, recorded)] += 1
    return {reason: count for reason, count in counts.items() if count}


def without_onset(recorded: Recorded, channels: Sequence[Channel]) -> Mapping[str, int]:
    """Returns the number of runs with friction and without an onset by the reason, a verb as in `left_out`.

    The foam holds a block that leans on it, so its onset tells nothing of friction; its slide does once it is clear. A
    block that held tells that friction is no less.
    """
    used = _runs(channel for channel in channels if channel.shares_friction)
    onsets = [channel.rows for channel in channels if channel.name == ONSET]
    slid = {int(run) for rows in onsets for run in rows.run[~rows.limit]}
    return Counter(_unknown(recorded.tracks[run], recorded) for run in sorted(used - slid))


def _runs(channels: Iterable[Channel]) -> set[int]:
    """Returns the indices of the runs that have a row in one of the channels."""
    return {int(run) for channel in channels for run in channel.rows.run}


def _unknown(track: RunTrack, recorded: Recorded) -> str:
    if leans(track, recorded.setting):
        return LEANED
    return HELD if track.sample.censored else LEVEL


def _reason(track: RunTrack, recorded: Recorded) -> str:
    if leans(track, recorded.setting):
        return LEANED
    return TOO_SHORT if track.slid else HELD
