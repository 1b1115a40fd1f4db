"""The true motion of the plate: the reported attitude, turned by the effects, as one table row per stretch of time.

Between two knots gravity moves in P along a great circle: g(t) = g₀ cos Ωt + d sin Ωt.
"""

from __future__ import annotations

from dataclasses import replace
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from station.physics.circle import cos_sin
from station.physics.contact import GRAVITY_M_S2, Array, Contact
from station.physics.model import Model
from station.physics.reversals import SWINGS
from station.physics.turned import seen_turned
from station.simulators.planar.commands import STEADY_RAD_S, Commands, tilt_of

Index = NDArray[np.intp]


class Column(IntEnum):
    """Rows of a `Plate`'s table: first of three where a vector is meant."""

    GRAVITY = 0
    ACROSS = 3
    PACE = 6
    BEGIN = 7
    END = 8
    RATE = 9
    ACCELERATION = 12
    PIVOT = 15
    RISING = 18
    STEP_BEGIN = 19
    TURNED = 20
    SWING = 21
    COUNT = 24


class Down(NamedTuple):
    """Gravity in P, m/s²: three arrays."""

    x: Array
    y: Array
    z: Array


class Plate:
    """The stretches between the knots of n runs: `table` (24, n·(k−1)), a run's stretches one after another."""

    def __init__(self, commands: Commands, model: Model) -> None:
        self.commands = commands
        self.knots = commands.time_s.shape[1]
        self.step_begins = _step_begins(commands)
        first, last = commands.gravity[:, :-1], commands.gravity[:, 1:]
        if model.acting("motion"):
            self.commands = self._moved(model, first, last)
        if model.acting("attitude"):
            first, last = (self._turned(model, gravity, end) for gravity, end in ((first, 0), (last, 1)))
        self.table = self._tabled(first, last)

    def stretch(self, row: Index, number: Index) -> Array:
        """Returns the columns (24, a) of stretch `number` (a,) of run `row` (a,)."""
        return self.table.take(row * (self.knots - 1) + number, axis=1)

    def _tabled(self, first: Array, last: Array) -> Array:
        commands = self.commands
        lengths = np.diff(commands.time_s, axis=1)
        cosine = np.sum(first * last, axis=-1)
        across = last - cosine[..., None] * first
        sine = np.linalg.norm(across, axis=-1)
        table = np.empty((Column.COUNT, *lengths.shape))
        table[Column.GRAVITY : Column.GRAVITY + 3] = GRAVITY_M_S2 * np.moveaxis(first, -1, 0)
        table[Column.ACROSS : Column.ACROSS + 3] = np.moveaxis(across, -1, 0) * (
            GRAVITY_M_S2 / np.where(sine > 0, sine, 1.0)
        )
        table[Column.PACE] = np.arctan2(sine, cosine) / np.where(lengths > 0, lengths, 1.0)
        table[Column.BEGIN], table[Column.END] = commands.time_s[:, :-1], commands.time_s[:, 1:]
        table[Column.RATE : Column.RATE + 3] = np.moveaxis(commands.rate_rad_s, -1, 0)
        table[Column.ACCELERATION : Column.ACCELERATION + 3] = np.moveaxis(commands.acceleration_rad_s2, -1, 0)
        table[Column.PIVOT : Column.PIVOT + 3] = np.moveaxis(commands.pivot_m_s2, -1, 0)
        table[Column.RISING] = commands.rising
        table[Column.TURNED] = commands.turned_rad
        table[Column.SWING : Column.SWING + SWINGS] = np.moveaxis(commands.swing_rad, -1, 0)
        table[Column.STEP_BEGIN] = self.step_begins
        return table.reshape(Column.COUNT, -1)

    def _moved(self, model: Model, first: Array, last: Array) -> Commands:
        """Returns the commands with the plate's own rates and accelerations, the means of those at both ends."""
        both = [model.motion(self._contact(gravity, end)) for gravity, end in ((first, 0), (last, 1))]
        rate, acceleration = (0.5 * (begin + end).reshape(first.shape) for begin, end in zip(*both, strict=True))
        return replace(self.commands, rate_rad_s=rate, acceleration_rad_s2=acceleration)

    def _turned(self, model: Model, gravity: Array, end: int) -> Array:
        """Returns gravity (n, k−1, 3) in the plate as it truly stands."""
        return seen_turned(gravity, model.attitude(self._contact(gravity, end)).reshape(gravity.shape))

    def _contact(self, gravity: Array, end: int) -> Contact:
        """Returns the contact at the first knots (`end` 0) or the last ones (1) of the stretches, flattened."""
        time_s = self.commands.time_s[:, end : end + gravity.shape[1]]
        return _level_contact(self.commands, gravity.reshape(-1, 3), time_s, self.step_begins)


def gravity_at(stretch: Array, time_s: Array) -> Down:
    """Gives gravity in P, m/s², at times `time_s` (a,), s, within the columns `stretch` (24, a) of a plate's table."""
    angle = (time_s - stretch[Column.BEGIN]) * stretch[Column.PACE]
    cosine, sine = cos_sin(angle)
    first, across = Column.GRAVITY, Column.ACROSS
    return Down(*(stretch[first + axis] * cosine + stretch[across + axis] * sine for axis in range(3)))


def _step_begins(commands: Commands) -> Array:
    """Returns the begin of the present or last step of each stretch (n, k−1), s."""
    turning = np.linalg.norm(commands.rate_rad_s, axis=-1) > STEADY_RAD_S
    begins = turning & ~np.concatenate([np.zeros((len(turning), 1), bool), turning[:, :-1]], axis=1)
    begins[:, 0] = True
    began = np.maximum.accumulate(np.where(begins, np.arange(begins.shape[1]), 0), axis=1)
    return np.take_along_axis(commands.time_s[:, :-1], began, axis=1)


def _level_contact(commands: Commands, gravity: Array, time_s: Array, step_begins: Array) -> Contact:
    """Returns the block at its start, at every knot: what an effect on the attitude may ask for, flattened."""
    n, k = time_s.shape
    each = {name: np.repeat(getattr(commands, name), k) for name in _ONE_A_RUN}
    zero = np.zeros(n * k)
    down = np.arctan2(gravity[:, 1], gravity[:, 0])
    return Contact(
        moving=np.zeros(n * k, dtype=bool),
        way_rad=down,
        speed_m_s=zero,
        x_m=np.repeat(commands.start[:, 0], k),
        y_m=np.repeat(commands.start[:, 1], k),
        yaw_rad=np.repeat(commands.start[:, 2], k),
        rest_s=(commands.rest_s[:, None] + time_s - commands.time_s[:, :1]).ravel(),
        slid_s=zero,
        tilt_rad=tilt_of(gravity),
        down_rad=down,
        rate_rad_s=commands.rate_rad_s.reshape(-1, 3),
        acceleration_rad_s2=commands.acceleration_rad_s2.reshape(-1, 3),
        rising=commands.rising.ravel(),
        gone_rad=np.abs(tilt_of(gravity) - commands.turned_rad.ravel()),
        swing_rad=commands.swing_rad.reshape(-1, SWINGS),
        step_s=(time_s - step_begins).ravel(),
        border_m=np.full(n * k, np.inf),
        spare_m_s2=np.full(n * k, np.nan),
        **each,
    )


_ONE_A_RUN = ("run", "mount_rad", "mass_kg", "area_m2", "temperature_c", "relative_humidity")
