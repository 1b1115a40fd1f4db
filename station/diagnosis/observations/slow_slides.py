"""Blocks that slide slowly before they are read to slip.

Where friction grows with the speed, or a drag does, a block that passes its limit does not get away: it goes on at the
speed at which both hold the load (Ruina 1983, J. Geophys. Res. 88, 10359), by millimetres in seconds, and a slip is
read when it has become fast. The load of that moment is what holds at that speed, and the way before it follows from
loads alone: at the load q it goes at the speed v for which what holds is h(v) = h(v_s) q / q_s, with the speed v_s and
the load q_s just before the slip. A law without such a growth has no speed below v_s for these loads: its block would
stand.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
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
"""The frames that a speed is read from at least, two thirds of those in SEEN_NS at 90 Hz."""

SPEEDS = 6
"""The speeds from the noise to a run's own at which what holds is evaluated; between them it is a straight line."""

LEAST = 1e-12
"""A guard of divisions by what holds, which may fall to nothing, and by its growth."""

HOLDING = ("friction", "push")
"""The methods of `Effect` that can hold a sliding block."""


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
        self._held = Latest(self._holds, HOLDING)

    def _holds(self, model: Model) -> Array:
        """Returns what holds the blocks at each of the speeds over that at v_s (r, SPEEDS + 1)."""
        held = model.friction(self._sliding).reshape(self._speeds.shape)
        if model.acting("push"):
            held = held + self._drag(model)
        held = np.maximum(held, LEAST)
        return held / held[:, -1:]

    def _drag(self, model: Model) -> Array:
        """Returns by how much pushes hold at each of the speeds more than at none, over the press (r, SPEEDS + 1)."""
        push = model.push(self._sliding)
        press = np.maximum(self._sliding.pressing_m_s2 - push[:, 2], LEAST)
        against = (-(push[:, :2] * self._sliding.way).sum(axis=1) / press).reshape(self._speeds.shape)
        return against - against[:, :1]

    def log_grown_of(self, model: Model, run: Times) -> Array:
        """Returns the growth (n,) of the log of what holds from the least speed that shows to v_s; none where it falls.

        `run` (n,) are runs by their indices; one that did not slide before its slip has none.
        """
        grown, row = np.maximum(-np.log(self._held(model)[:, 1]), 0.0), np.searchsorted(self.runs, run)
        row = np.minimum(row, len(self.runs) - 1)
        return np.where(self.runs[row] == run, grown[row], 0.0)

    def before(self, run: Times, tilt_rad: Array) -> Before:
        """Returns the moments before slips among n stretches of `run` (n,), with tilts `tilt_rad` (n, k), rad."""
        rows = np.flatnonzero(np.isin(run, self.runs))
        of = np.searchsorted(self.runs, run[rows])
        return Before(self, rows, of, np.tan(tilt_rad[rows]) / np.tan(self.tilt_rad)[of, None])

    def speed_m_s(self, model: Model, row: Times, share: Array) -> Array:
        """Returns the speeds (m,), m/s, of the blocks of `runs[row]` (m,) at a `share` (m,) of the load at v_s."""
        held = np.maximum.accumulate(self._held(model), axis=1)[row]
        return _interpolated(share, held, self._speeds[row])

    def least_share(self, model: Model) -> Array:
        """Returns the share (r,) of the load at v_s at which the blocks begin to slide."""
        return self._held(model)[:, 0]


@dataclass(frozen=True, eq=False)
class Before:
    """Moments before slips, of the stretches `rows` (m,) of `slow.runs[row]` (m,), at a `share` (m, k) of the load."""

    slow: SlowSlides
    rows: Times
    row: Times
    share: Array

    def speed_m_s(self, model: Model) -> Array:
        """Returns the speeds (m, k), m/s, at which the blocks go; 0 where they stand."""
        found = np.zeros(self.share.shape)
        goes = self.share > self.slow.least_share(model)[self.row, None]
        if goes.any():
            found[goes] = self.slow.speed_m_s(model, self.row[np.nonzero(goes)[0]], self.share[goes])
        return found


def _interpolated(at: Array, known: Array, values: Array) -> Array:
    """Returns values (m, k), known at ascending places (m, k), at one place in each row `at` (m,), or the last ones."""
    rows, last = np.arange(len(at)), known.shape[1] - 1
    after = np.clip((known <= at[:, None]).sum(axis=1), 1, last)
    first, second = known[rows, after - 1], known[rows, after]
    share = np.clip((at - first) / np.maximum(second - first, LEAST), 0.0, 1.0)
    return values[rows, after - 1] + share * (values[rows, after] - values[rows, after - 1])


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
