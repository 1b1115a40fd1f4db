"""The bench: block, plate and arm of a world, advanced in time. Session, truth and pilot runs all use this one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.proof.patch_world import integrator as eq
from tests.proof.patch_world import places as at
from tests.proof.patch_world import plate
from tests.proof.patch_world.draws import Draw, contact_of, friction_of, plate_waves
from tests.proof.patch_world.world import World

Array = NDArray[np.float64]
TICK_S = 1e-4
"""The integrator's step, which a test halves; frames and readings of the attitude fall on its multiples."""
_SHORTEST_S = 0.05


@dataclass(frozen=True, slots=True)
class Moment:
    """Everything that changes, copied: to go on from here in another world."""

    state: Array
    bristles: Array


class Bench:
    """A block on the plate of a world's arm. `state` is indexed by the names in integrator.py."""

    def __init__(self, world: World, *, step_s: float = TICK_S) -> None:
        self.world, self._step_s = world, step_s
        self._numbers = eq.numbers_of(world.contact)
        self._plate = plate_waves(world)
        self._spots = np.array(world.patch.spots, dtype=float).reshape(-1, 4)
        self._tones = np.array(world.tones, dtype=float).reshape(-1, 4)
        self.state = np.zeros(at.SIZE)
        self.state[at.HELD] = 1.0
        self.motion = np.zeros(9)
        self._before: float | None = None
        self.friction = 1.0

    def place(self, x: float, y: float, yaw: float = 0.0) -> None:
        """Puts the block there, at rest (m, rad)."""
        self.state[[at.X, at.Y, at.YAW]] = x, y, yaw
        self.state[at.FRESH] = 0.0

    def begin_run(self, draw: Draw, *, run: int, azimuth: float, before: float | None) -> None:
        """Lays the block on a new contact, with the friction of this run; the plate is level."""
        history = self.world.history
        sole = contact_of(draw, history)
        self._points, self._share, self._sole = sole.points, sole.share, sole.friction
        self._balance = eq.balance_of(sole.points, sole.share)
        self._strength, self._load = np.ones(len(sole.points)), np.ones(len(sole.points))
        self._bristles = np.zeros((len(sole.points), 2))
        self._waves = np.ascontiguousarray(np.vstack([self._plate, draw.waves]))
        self.friction = friction_of(draw, history, run=run, time_s=self.time_s, azimuth=azimuth, before=before)
        self.state[[at.VX, at.VY, at.SPIN, at.FRESH, at.PULL_X, at.PULL_Y]] = 0.0
        self.state[at.HELD] = 1.0

    @property
    def time_s(self) -> float:
        """The time since the begin."""
        return float(self.state[at.T])

    def ask(self, angle: float, *, azimuth: float, rate: float) -> float:
        """Begins a motion to an angle (rad) at about that rate (rad/s) from what is asked now; returns its end (s)."""
        asked, speed, bend = self._asked()
        lasts = 1.3 * abs(angle - asked) / rate + 1.3 * abs(speed) / rate * 0.2 + _SHORTEST_S
        self.motion = np.concatenate([[self.time_s, lasts, azimuth], _quintic(asked, speed, bend, angle, lasts)])
        return self.time_s + lasts

    def _asked(self) -> tuple[float, float, float]:
        """The angle that is asked for now, and its first and second derivative."""
        s = self.time_s - self.motion[at.BEGIN]
        if s >= self.motion[at.LASTS]:
            return float(plate.angle_asked(self.time_s, self.motion)), 0.0, 0.0
        polynomial = np.polynomial.Polynomial(self.motion[at.POLYNOMIAL :])
        return tuple(float(polynomial.deriv(k)(s)) if k else float(polynomial(s)) for k in range(3))  # type: ignore[return-value]

    def advance(self, until_s: float) -> None:
        """Goes on to a time (s)."""
        eq.advance(
            until_s, self._step_s, self.state, self._bristles, self._strength, self._load, self._points, self._share,
            self._balance, self._sole, self._waves, self._spots, self._tones, self.motion, self.friction,
            self._numbers,
        )  # fmt: skip

    def moment(self) -> Moment:
        """A copy of what changes."""
        return Moment(self.state.copy(), self._bristles.copy())

    def resume(self, moment: Moment) -> None:
        """Goes back to a moment, which may be another world's bench's; the run must have begun here, too."""
        self.state, self._bristles = moment.state.copy(), moment.bristles.copy()
        self.state[at.FRESH] = 0.0


def _quintic(angle: float, speed: float, bend: float, goal: float, lasts: float) -> list[float]:
    """Coefficients of the quintic that goes on smoothly from (angle, speed, bend) and rests at `goal` after `lasts`."""
    d = goal - angle
    t = lasts
    return [
        angle,
        speed,
        bend / 2,
        (20 * d - 12 * speed * t - 3 * bend * t * t) / (2 * t**3),
        (-30 * d + 16 * speed * t + 3 * bend * t * t) / (2 * t**4),
        (12 * d - 6 * speed * t - bend * t * t) / (2 * t**5),
    ]


def downhill(azimuth: float) -> tuple[float, float]:
    """Downhill in the plate for a tilt about the axis at `azimuth` (rad): the paper's t × k."""
    return math.sin(azimuth), -math.cos(azimuth)
