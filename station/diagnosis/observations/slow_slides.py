"""Blocks that slide slowly before they are read to slip.

Where friction grows with the speed, a block that passes its limit does not get away: it goes on at the speed at which
friction holds the load (Ruina 1983, J. Geophys. Res. 88, 10359), by millimetres in seconds, and a slip is read when it
has become fast. The load of that moment is friction at that speed, and the way before it follows from loads alone: at
the load q it goes at the speed v for which friction is h(v) = h(v_s) q / q_s, with the speed v_s and the load q_s just
before the slip. A law without such a growth has no speed below v_s for these loads: its block would stand.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from station.diagnosis.observations.moments import Latest, Moments
from station.diagnosis.observations.plate import PlateMotion, Times
from station.diagnosis.observations.starts import starts
from station.diagnosis.observations.stretches import BEFORE_SLIP_NS
from station.diagnosis.observations.tracks import NOISE_SPEEDS, RunTrack
from station.physics.contact import Array, Contact
from station.physics.model import Model

if TYPE_CHECKING:
    from station.diagnosis.observations.build import Recorded

SEEN_NS = 100_000_000
"""The time until BEFORE_SLIP_NS before a slip in which the speed is read: it grows by a tenth of itself meanwhile."""

LEAST_FRAMES = 6
SPEEDS = 12
"""The speeds between the noise and a run's own at which friction is evaluated; between them it is a straight line."""


class SlowSlides:
    """Runs (r,), by their indices, with the speeds v_s (r,) before their slips, and the least that shows (r,), m/s.

    `contact` (r,) has the blocks at the moments of these speeds.
    """

    def __init__(self, runs: Times, contact: Contact, speed_m_s: Array, least_m_s: Array) -> None:
        self.runs, self.tilt_rad = runs, contact.tilt_rad
        ladder = np.geomspace(least_m_s, speed_m_s, SPEEDS, axis=1)
        self._speeds = np.column_stack([np.zeros(len(runs)), ladder])
        sliding = contact.chosen(np.repeat(np.arange(len(runs)), self._speeds.shape[1]))
        self._sliding = replace(
            sliding,
            moving=np.ones(len(sliding), dtype=np.bool_),
            way_rad=sliding.down_rad,
            speed_m_s=self._speeds.ravel(),
        )
        self._held = Latest(self._holds, ("friction",))

    def _holds(self, model: Model) -> Array:
        """Returns friction at each of the speeds over that at v_s (r, SPEEDS + 1)."""
        held = model.friction(self._sliding).reshape(self._speeds.shape)
        return held / held[:, -1:]

    def log_grown_of(self, model: Model, run: Times) -> Array:
        """Returns the growth (n,) of log friction from the least speed that shows to v_s; none where it falls.

        `run` (n,) are runs by their indices; one that did not slide before its slip has none.
        """
        grown, row = np.maximum(-np.log(self._held(model)[:, 1]), 0.0), np.searchsorted(self.runs, run)
        row = np.minimum(row, len(self.runs) - 1)
        return np.where(self.runs[row] == run, grown[row], 0.0)

    def speed_m_s(self, model: Model, run: int, tilt_rad: Array) -> Array:
        """Returns the speeds (m, k), m/s, of the block of `runs[run]` at `tilt_rad` (m, k), rad, before its slip."""
        share = np.tan(tilt_rad) / np.tan(self.tilt_rad[run])
        return np.interp(share, np.maximum.accumulate(self._held(model)[run]), self._speeds[run], left=0.0)


def slow_slides(recorded: Recorded) -> SlowSlides | None:
    """Returns the runs of a recording that slide slowly before they are read to slip; None without any."""
    found = [(run, *seen) for run, track in enumerate(recorded.tracks) if (seen := before_slip(track, recorded.plate))]
    if not found:
        return None
    runs, time_ns, speed, least = (np.array(column) for column in zip(*found, strict=True))
    return SlowSlides(runs, _contact(recorded, runs, time_ns), speed, least)


def before_slip(track: RunTrack, plate: PlateMotion) -> tuple[int, float, float] | None:
    """Returns when a block's speed down the slope was read, ns, that speed, and the least that shows, m/s, or None."""
    if not track.slip_ns:
        return None
    until = track.slip_ns - BEFORE_SLIP_NS
    frames = track.frames(max(until - SEEN_NS, track.tilt_ns), until)
    count = frames.stop - frames.start
    if count < LEAST_FRAMES:
        return None
    middle = int(track.time_ns[frames].mean())
    seconds = (track.time_ns[frames] - middle) * 1e-9
    down = plate.at(np.array([middle])).down_rad[0]
    way = track.pose[frames, :2] @ np.array([np.cos(down), np.sin(down)])
    speed = float(np.polyfit(seconds, way, 1)[0])
    least = NOISE_SPEEDS * track.sigma_m / float(np.sqrt(count) * seconds.std())
    return (middle, speed, least) if speed > least else None


def _contact(recorded: Recorded, runs: Times, time_ns: Times) -> Contact:
    pose = starts([recorded.tracks[run] for run in runs])
    return Moments(
        time_ns=time_ns,
        run=runs,
        facts=recorded.facts,
        attitude=lambda delay_s: recorded.plate.at(time_ns, delay_s=delay_s),
        place_m=pose[:, :2],
        yaw_rad=pose[:, 2],
    ).reported
