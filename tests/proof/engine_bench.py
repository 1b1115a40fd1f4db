"""Another author's physics engine under the block of the patch world: its arm and camera, the engine's contact.

The engine has a level plate that stands still, and a block. What the plate's turning frame does to the block (gravity,
the pivot's acceleration, Euler's, centrifugal and Coriolis' terms) is its gravity; effects and foam are forces on it.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tests.proof.patch_world import places as at
from tests.proof.patch_world.bench import TICK_S, Bench, Moment
from tests.proof.patch_world.draws import Draw
from tests.proof.patch_world.places import AZIMUTH, VX, VY, T
from tests.proof.patch_world.plate import arm, foreign, loads, wall
from tests.proof.patch_world.world import World

Array = NDArray[np.float64]
LEVEL_RAD, SLOW_M_S, SETTLED_S = 1e-4, 1e-4, 1.0
"""A block that is slower on a plate that is level and has not moved for so long stays where it is."""


class Engine(Protocol):
    """A block on a level plate in an engine; its time step is fixed."""

    step_s: float

    def put(self, x: float, y: float, yaw: float, *, mu: float) -> None:
        """Lays the block there, at rest (m, rad), on a contact of this friction."""
        ...

    def step(self, pull: Array, force: Array, moment: float) -> None:
        """One step under an acceleration of everything (3), m/s²; a force (2) on the block, N, and a moment, N m."""
        ...

    def read(self) -> tuple[float, float, float, float, float, float]:
        """Place, yaw, velocity and rate of turning of the block."""
        ...


class EngineBench(Bench):
    """A bench whose block is an engine's.

    Engines add a step's acceleration before they move by the new velocity, which runs half a step ahead: the block is
    read half a step earlier, and its acceleration is that of the middle of the step.
    """

    def __init__(self, world: World, engine: Engine) -> None:
        super().__init__(world)
        self._engine, self._engine_s = engine, 0.0
        self._pulls = np.zeros(6)

    def begin_run(self, draw: Draw, *, run: int, azimuth: float, before: float | None) -> None:
        """Lays the block on a contact with the friction of this run."""
        super().begin_run(draw, run=run, azimuth=azimuth, before=before)
        self._put()

    def resume(self, moment: Moment) -> None:
        """Goes back to a moment, at rest."""
        super().resume(moment)
        self._put()

    def _put(self) -> None:
        x, y, yaw = self.state[[at.X, at.Y, at.YAW]].tolist()
        self._engine.put(x, y, yaw, mu=self.world.contact.mu * self.friction)
        self._engine_s = self.time_s

    def advance(self, until_s: float) -> None:
        """Goes on to a time (s)."""
        state, step_s = self.state, self._engine.step_s
        if self._stays():
            state[at.T] = self._engine_s = until_s
            return
        while self._engine_s + step_s <= until_s + 0.5 * TICK_S:
            middle, end = self._engine_s + 0.5 * step_s, self._engine_s + step_s
            turning = _swing(middle, TICK_S, state, self.motion, self._numbers)
            _pull(state, self.motion[AZIMUTH], turning, self._tones, self._numbers, self._pulls)
            self._engine.step(self._pulls[:3], self._pulls[3:5], float(self._pulls[5]))
            _swing(end, TICK_S, state, self.motion, self._numbers)
            state[at.X : at.SPIN + 1] = self._engine.read()
            self._engine_s = end
        _swing(until_s, TICK_S, state, self.motion, self._numbers)
        state[at.T] = until_s
        late = until_s - self._engine_s - 0.5 * step_s
        read = np.array(self._engine.read())
        state[at.X : at.YAW + 1] = read[:3] + late * read[3:]

    def _stays(self) -> bool:
        state, contact = self.state, self.world.contact
        quiet = self.time_s > self.motion[at.BEGIN] + self.motion[at.LASTS] + SETTLED_S
        level = abs(state[at.ANGLE]) < LEVEL_RAD and np.hypot(state[at.VX], state[at.VY]) < SLOW_M_S
        return bool(quiet and level and contact.gust_n == 0.0 and not len(self._tones))


@njit(cache=True, error_model="numpy")
def _swing(until: float, dt: float, s: Array, motion: Array, numbers: Array) -> float:
    """Advances the arm alone to a time; returns the plate's angular acceleration (rad/s²)."""
    c, turning = numbers[0], 0.0
    for _ in range(round((until - s[T]) / dt)):
        turning = arm(s, motion, dt, c)
        s[T] += dt
    return turning


@njit(cache=True, error_model="numpy")
def _pull(s: Array, azimuth: float, turning: float, tones: Array, numbers: Array, out: Array) -> None:  # noqa: PLR0917
    """Acceleration of everything in the plate's frame (3), force (2) and moment on the block, into `out` (6)."""
    c = numbers[0]
    px, py, press = loads(s, azimuth, turning, tones, c)
    fx, fy = foreign(s, c)
    wx, wy, moment = wall(s, c)
    out[0], out[1], out[2] = px, py, -press
    out[3], out[4], out[5] = fx + wx - c.film * s[VX], fy + wy - c.film * s[VY], moment
