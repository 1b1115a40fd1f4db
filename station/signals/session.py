"""All the signals of a session, or of a part of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from shared.messages import CameraGeometry, Sample
from station.signals.tracks import (
    AngleTrack,
    AttitudeTrack,
    CommandTrack,
    CornerTrack,
    EnvironmentTrack,
    EventTrack,
    MotionTrack,
    PoseTrack,
)


@dataclass(frozen=True, eq=False, kw_only=True)
class Signals:
    """The measurements of a session. `geometry` (None: no calibration was recorded) turns pixels into places.

    `corners` is the block's marker, `fiducials` the plate's by marker id, `block` the block by another tracker,
    `angles` the other angle sensors by source.
    """

    corners: CornerTrack
    fiducials: Mapping[int, CornerTrack]
    block: PoseTrack
    attitude: AttitudeTrack
    commands: CommandTrack
    motions: MotionTrack
    events: EventTrack
    environment: EnvironmentTrack
    angles: Mapping[str, AngleTrack] = field(default_factory=dict[str, AngleTrack])
    geometry: CameraGeometry | None = None
    samples: tuple[Sample, ...] = ()

    def between(self, from_ns: int, to_ns: int) -> Signals:
        """Returns the part with from_ns ≤ capture time < to_ns, as views; samples whose run began in it."""
        return replace(
            self,
            corners=self.corners.between(from_ns, to_ns),
            fiducials={number: track.between(from_ns, to_ns) for number, track in self.fiducials.items()},
            block=self.block.between(from_ns, to_ns),
            attitude=self.attitude.between(from_ns, to_ns),
            commands=self.commands.between(from_ns, to_ns),
            motions=self.motions.between(from_ns, to_ns),
            events=self.events.between(from_ns, to_ns),
            environment=self.environment.between(from_ns, to_ns),
            angles={source: track.between(from_ns, to_ns) for source, track in self.angles.items()},
            samples=tuple(sample for sample in self.samples if from_ns <= sample.start_ns < to_ns),
        )

    @property
    def runs(self) -> tuple[int, ...]:
        """The numbers of the runs that have events, in order of their beginning."""
        _, first = np.unique(self.events.run, return_index=True)
        return tuple(int(self.events.run[row]) for row in np.sort(first))

    def span_ns(self, run: int) -> tuple[int, int]:
        """Returns the first and the last event of a run.

        Raises:
            KeyError: if the run has no events.
        """
        times = self.events.time_ns[self.events.run == run]
        if not len(times):
            raise KeyError(f"run {run} has no events; runs with events are {self.runs}")
        return int(times.min()), int(times.max())

    def run(self, run: int) -> Signals:
        """Returns the part from the first to the last event of a run, both included, with that run's sample."""
        first_ns, last_ns = self.span_ns(run)
        part = self.between(first_ns, last_ns + 1)
        return replace(part, samples=tuple(sample for sample in self.samples if sample.run == run))
