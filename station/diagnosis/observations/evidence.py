"""All the evidence of a recording: its channels, its runs, and notes on what it lacks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from station.diagnosis.observations.channel import ALONG, ONSET, Channel
from station.diagnosis.observations.moments import RunFacts
from station.diagnosis.observations.rig_offsets import UNKNOWN_OFFSETS, RigOffsets
from station.diagnosis.observations.tips import NO_TIPS, Tips
from station.physics.contact import Array, Bools, Contact

if TYPE_CHECKING:
    from station.diagnosis.likelihood.noise import Noise
    from station.diagnosis.observations.paths import Paths
    from station.diagnosis.observations.slide_tracks import SlideTracks


Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Evidence:
    """The evidence; `run_number` (r,) are the recording's own numbers, and rows refer to runs by their index in it.

    `tips` has the runs in which the block toppled: no channel has those. `paths` are the blocks' breakaways, if slides
    are not plain, whose slips were read with `rig_offsets`; `slide_tracks` are the slides frame by frame. Runs that are
    `held_out` (r,) are predicted and not fitted; None: there are none. `floor` is the least noise of rows and runs.
    `group` (r,) numbers the groups of runs that share a draw of friction, as those of one specimen; None: each run is
    on its own. `stretch` (r,) numbers the stretches of one speed in continuous records; None: there are too few to know
    how they scatter. `left_out` counts the runs without a row of friction by the reason, a verb whose subject they are,
    and `without_onset` those with such rows of which no onset is known.
    """

    channels: tuple[Channel, ...]
    run_number: Array
    facts: RunFacts
    total_runs: int
    notes: tuple[str, ...] = field(default=())
    tips: Tips = NO_TIPS
    paths: Paths | None = None
    rig_offsets: RigOffsets = UNKNOWN_OFFSETS
    slide_tracks: SlideTracks | None = None
    held_out: Bools | None = None
    floor: Noise | None = None
    group: Index | None = None
    stretch: Index | None = None
    left_out: Mapping[str, int] = field(default_factory=dict[str, int])
    without_onset: Mapping[str, int] = field(default_factory=dict[str, int])

    def channel(self, name: str) -> Channel | None:
        """Returns the channel of that name, or None."""
        return next((channel for channel in self.channels if channel.name == name), None)

    @property
    def onsets(self) -> Channel | None:
        """The channel of static friction, or None."""
        return self.channel(ONSET)

    @property
    def slides(self) -> Channel | None:
        """The channel of sliding friction, or None."""
        return self.channel(ALONG)

    @property
    def friction(self) -> Channel | None:
        """The channel of static friction, or else that of sliding friction; None without either."""
        return self.onsets or self.slides

    @property
    def runs(self) -> int:
        """The number of runs with evidence."""
        return len(self.run_number)

    @property
    def counted(self) -> Bools:
        """The runs (r,) to which models are fitted, as a mask."""
        return np.ones(self.runs, dtype=np.bool_) if self.held_out is None else ~self.held_out

    def is_record(self, channel: Channel) -> bool:
        """Returns true if a channel's rows are windows of continuous records, each the mean of many readings."""
        return self.group is not None and channel.travelled_m is not None

    def known(self, channel: Channel) -> Bools:
        """Returns the rows (n,) of a channel that tell its noise, as a mask.

        Their runs count, and their residuals are values, not limits, that nothing but the measurement leads astray.
        """
        rows = channel.rows
        return ~rows.limit & ~rows.strayed & self.counted[rows.run]

    @property
    def block(self) -> Index:
        """The first run (r,) of each run's group: runs of different blocks are independent."""
        if self.group is None:
            return np.arange(self.runs)
        _, first, of = np.unique(self.group, return_index=True, return_inverse=True)
        return first[of]

    @property
    def cluster(self) -> Index:
        """The first run (r,) of each run's stretch, or of its block: their shares of a score scatter as they may."""
        if self.stretch is None:
            return self.block
        _, first, of = np.unique(self.stretch, return_index=True, return_inverse=True)
        return first[of]

    def contact(self) -> Contact | None:
        """Returns the recorded contacts of the onsets, or else of the slides; None without either."""
        return next((one.contact for one in (self.onsets, self.slides) if one is not None), None)

    def used(self) -> int:
        """Returns the number of counted runs with at least one row of friction."""
        rows = [channel.rows.run for channel in self.channels if channel.shares_friction]
        return int(self.counted[np.unique(np.concatenate(rows))].sum()) if rows else 0

    def without(self, runs: Bools) -> Evidence:
        """Returns the same rows with the masked runs (r,) held out, also from the blocks' first paths."""
        kept = self.counted & ~runs
        paths = None if self.paths is None else self.paths.of_runs(self.facts.number[kept])
        return replace(self, held_out=~kept, paths=paths)
