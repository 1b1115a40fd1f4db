"""Builds a session's evidence from its signals."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from shared.messages import Sample
from station.diagnosis import thresholds
from station.diagnosis.observations.channel import Channel
from station.diagnosis.observations.dwell_by_tilt import dwell_by_tilt
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.image_rows import plate_channels, rest_channel, shape_channel
from station.diagnosis.observations.left_out import left_out, without_onset
from station.diagnosis.observations.moments import RunFacts
from station.diagnosis.observations.onset_rows import onset_channel
from station.diagnosis.observations.onsets import Onsets
from station.diagnosis.observations.paths import Paths
from station.diagnosis.observations.plate import PlateMotion
from station.diagnosis.observations.rig_offsets import UNKNOWN_OFFSETS, RigOffsets
from station.diagnosis.observations.sensor_rows import sensor_channels
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.slide_rows import slide_channels
from station.diagnosis.observations.slide_tracks import slide_tracks
from station.diagnosis.observations.slips import Reread, reread
from station.diagnosis.observations.slow_slides import slow_slides
from station.diagnosis.observations.tips import tips_of
from station.diagnosis.observations.tracks import RunTrack, run_tracks
from station.diagnosis.observations.windows import windows_of
from station.signals.session import Signals


class Recorded:
    """The data from which the builders of the channels work; `free_windows` are those clear of the foam.

    Slips are read with `rig_offsets`, on the plate `slipping`, which is `plate` for frames that are stamped late.
    """

    def __init__(self, signals: Signals, setting: Setting, rig_offsets: RigOffsets = UNKNOWN_OFFSETS) -> None:
        self.signals, self.setting = signals, setting
        self.plate = PlateMotion(signals.attitude, signals.motions)
        self.slipping = self.plate.for_stamps(late_s=rig_offsets.late_s)
        tracks = tuple(track for track in run_tracks(signals) if self._usable(track))
        self.reread = reread(tracks, self.slipping, setting, rig_offsets)
        self.rig_offsets = RigOffsets(rig_offsets.late_s, self.reread.arm_m)
        self.tracks = self.reread.tracks
        self.facts = facts_of([track.sample for track in self.tracks], setting)
        self.dwell_by_tilt = dwell_by_tilt(self.tracks, self.facts.rest_ns, self.plate)
        self.slow_slides = slow_slides(self)
        self.windows = windows_of(self.tracks, setting)
        self.free_windows = self.windows[self.windows["free_m"] > thresholds.FREE_M]

    def _usable(self, track: RunTrack) -> bool:
        return len(self.plate) > 3 and self.plate.covers(track.slip_ns or track.end_ns)


def evidence_of(signals: Signals, setting: Setting, rig_offsets: RigOffsets = UNKNOWN_OFFSETS) -> Evidence:
    """Returns the evidence of a session; `notes` has one sentence for each thing that it lacks.

    A slip's moment is read from path and load together, with the stamps and the loads of `rig_offsets`. Models have
    their own delays and pivots; one with these finds the slips as it would have read them itself.
    """
    recorded = Recorded(signals, setting, rig_offsets)
    channels: list[Channel] = []
    onsets = next((channel for channel in onset_channel(recorded) if isinstance(channel, Onsets)), None)
    if onsets is not None:
        channels.append(onsets)
    channels.extend(slide_channels(recorded, onsets))
    for build in (rest_channel, plate_channels, shape_channel, sensor_channels):
        channels.extend(channel for channel in build(recorded) if len(channel))
    return Evidence(
        channels=tuple(channels),
        run_number=np.array([float(track.sample.run) for track in recorded.tracks]),
        facts=recorded.facts,
        total_runs=len(signals.samples),
        notes=tuple(_notes(recorded)),
        tips=tips_of(recorded),
        left_out=left_out(recorded, channels),
        without_onset=without_onset(recorded, channels),
        paths=_paths(recorded.reread, onsets),
        rig_offsets=recorded.rig_offsets,
        slide_tracks=slide_tracks(recorded) if len(recorded.free_windows) else None,
    )


def _paths(read: Reread, onsets: Onsets | None) -> Paths | None:
    """Returns the first paths of the runs whose onsets were re-estimated and are known; None without any."""
    if read.paths is None or onsets is None:
        return None
    row = {int(run): row for row, run in enumerate(onsets.rows.run)}
    known = np.array([index for index, run in enumerate(read.indices) if run in row], dtype=np.int64)
    if not len(known):
        return None
    rows = np.array([row[read.indices[index]] for index in known], dtype=np.int64)
    return Paths.of(read.paths.chosen(known), onsets.moments.reported.chosen(rows), read.law)


def _notes(recorded: Recorded) -> list[str]:
    signals, notes = recorded.signals, list[str]()
    if not len(signals.attitude):
        notes.append("no attitude of the plate was recorded (arm/platform), so no onset and no slide can be judged")
    if signals.geometry is None and not len(signals.block):
        notes.append("no calibration was recorded (camera/geometry), so the block's path is unknown")
    return notes


def facts_of(samples: Sequence[Sample], setting: Setting) -> RunFacts:
    """Returns the facts of each run; run numbers count from 0 at the first, unknown masses and areas are nominal."""

    def column(value: Callable[[Sample], float]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        return np.array([value(sample) for sample in samples], dtype=np.float64)

    first = min((sample.run for sample in samples), default=0)
    area = setting.block_side_m**2
    return RunFacts(
        number=column(lambda sample: sample.run - first),
        rest_ns=np.array([_rest_ns(sample) for sample in samples], dtype=np.int64),
        dwell_s=column(lambda sample: sample.dwell_s),
        mount_rad=column(lambda sample: sample.plate_mount_rad),
        mass_kg=column(lambda sample: sample.block_mass_kg or setting.block_mass_kg),
        area_m2=column(lambda sample: sample.block_area_m2 or area),
        temperature_c=column(lambda sample: sample.temperature_c or math.nan),
        relative_humidity=column(lambda sample: sample.relative_humidity or math.nan),
    )


def _rest_ns(sample: Sample) -> int:
    """Returns the time at which the block came to rest, or else that at which its run began."""
    return sample.rest_ns or sample.start_ns
