"""The state of one block for its model's effects, from what an engine knows at each step.

Effects depend on what no engine keeps: how long the block has lain, since when it slides, and whether the tilt rises.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from station.export.carried.states import USUAL, contact
from station.physics.contact import GRAVITY_M_S2, Array, Contact
from station.physics.reversals import swings
from station.rig.opening import room_m

STOPS_M_S = 1e-3
"""A slower block lies once its friction exceeds its load: it would stop within some milliseconds."""
GOES_M_S = 5e-3
"""A faster block slides, whatever its load: somebody has pushed it. A solver's unrest is slower."""
SLIP_M = 1e-5
"""A shorter slip is none, and renews no contact."""


class Moment(NamedTuple):
    """The state that an engine knows: time, gravity (3,), m/s², in the plate's frame P, and the block's motion in P.

    `place` is x, y (m) and yaw (rad), `velocity` what they change by (m/s, rad/s).
    """

    time_s: float
    gravity: Array
    place: Array
    velocity: Array

    @property
    def speed_m_s(self) -> float:
        """The speed of sliding."""
        return math.hypot(*self.velocity[:2])


@dataclass
class Watch:
    """Follows one run of one block; `said` are fields of `Contact` that do not change, such as mass_kg or run.

    `opening_m` is the radius of the opening in a soft border, if there is one.
    """

    said: dict[str, Any] = field(default_factory=dict[str, Any])
    opening_m: float = math.inf
    moving: bool = False

    def __post_init__(self) -> None:
        """Begins with nothing known."""
        self.last = Moment(math.nan, np.array([0.0, 0.0, -GRAVITY_M_S2]), np.zeros(3), np.zeros(3))
        self._rate, self._acceleration = np.zeros(3), np.zeros(3)
        self._rising, self._step_from_s, self._begun = 1.0, 0.0, False
        self._turns_rad = [-math.inf]
        self._rest_from_s = self._slid_from_s = math.nan
        self._from = np.zeros(2)
        self._known: tuple[Array, Contact] | None = None

    def take(self, now: Moment) -> None:
        """Takes the next moment, before anything is asked about it."""
        last, self.last, self._known = self.last, now, None
        if math.isnan(last.time_s):
            self._rest_from_s = now.time_s - float(self.said.get("rest_s", USUAL["rest_s"]))
            self._step_from_s = now.time_s
        elif now.time_s > last.time_s:
            self._turn(last, now, now.time_s - last.time_s)

    def _turn(self, last: Moment, now: Moment, seconds: float) -> None:
        """Follows the plate's turning by how gravity moves in it: a turn about gravity itself moves nothing."""
        rate = np.cross(now.gravity, last.gravity) / (np.dot(now.gravity, now.gravity) * seconds)
        self._acceleration = (rate - self._rate) / seconds if self._begun else np.zeros(3)
        turns = bool(np.linalg.norm(rate) > _STEADY_RAD_S)
        if turns and not np.linalg.norm(self._rate) > _STEADY_RAD_S:
            self._step_from_s = last.time_s
        change = tilt_of(now.gravity) - tilt_of(last.gravity)
        rising = self._rising if abs(change) < 1e-9 else math.copysign(1.0, change)
        if rising != self._rising:
            self._rising = rising
            self._turns_rad.append(tilt_of(last.gravity))
        # A swing back that is gone through again leaves no trace.
        while len(self._turns_rad) > 2 and rising * tilt_of(now.gravity) > rising * self._turns_rad[-2]:
            del self._turns_rad[-2:]
        self._rate, self._begun = rate, True

    def slides(self, *, excess: float) -> bool:
        """Decides by the `excess` of the load over friction, m/s², whether the block slides from now on."""
        now, speed, moved = self.last, self.last.speed_m_s, self.moving
        if not self.moving and (excess > 0 or speed > GOES_M_S):
            self.moving, self._slid_from_s, self._from = True, now.time_s, now.place[:2].copy()
        elif self.moving and excess < 0 and speed < STOPS_M_S:
            self.moving = False
            if np.linalg.norm(now.place[:2] - self._from) > SLIP_M:
                self._rest_from_s = now.time_s
        if self.moving != moved:
            self._known = None
        return self.moving

    def contact(self, *, way_rad: float, gravity: Array | None = None) -> Contact:
        """Returns the state at the last moment, for a slide in the direction `way_rad` under this gravity (3,).

        A law asks some times a moment: what does not depend on the direction is kept until something changes.
        """
        down = self.last.gravity if gravity is None else gravity
        if self._known is None or self._known[0] is not down:
            self._known = (down, self._contact(down))
        return replace(self._known[1], way_rad=np.array([way_rad]))

    def _contact(self, down: Array) -> Contact:
        """Returns the state at the last moment under this gravity (3,), for a slide in any direction."""
        now = self.last
        until_s = self._slid_from_s if self.moving else now.time_s
        known = {
            "moving": self.moving,
            "speed_m_s": now.speed_m_s if self.moving else 0.0,
            "x_m": now.place[0],
            "y_m": now.place[1],
            "yaw_rad": now.place[2],
            "slid_s": now.time_s - self._slid_from_s if self.moving else 0.0,
            "tilt_rad": tilt_of(down),
            "down_rad": math.atan2(down[1], down[0]),
            "rate_rad_s": self._rate,
            "acceleration_rad_s2": self._acceleration,
            "rising": self._rising,
            "gone_rad": abs(tilt_of(now.gravity) - self._turns_rad[-1]),
            "swing_rad": swings(self._turns_rad),
            "step_s": now.time_s - self._step_from_s,
            "border_m": self._border_m(now),
        }
        return contact(**{**self.said, **known, "rest_s": until_s - self._rest_from_s})

    def _border_m(self, now: Moment) -> float:
        half = 0.5 * math.sqrt(self.said.get("area_m2", USUAL["area_m2"]))
        x, y, yaw = (np.array([one]) for one in now.place)
        return float(room_m(self.opening_m, np.array([half]), (x, y, yaw))[0])


_STEADY_RAD_S = 2e-3
"""A plate that turns more slowly than this is held, as in a recording."""


def tilt_of(gravity: Array) -> float:
    """Returns the angle, rad, between the plate's normal and up, from gravity (3,) in the plate."""
    return math.atan2(math.hypot(gravity[0], gravity[1]), -gravity[2])
