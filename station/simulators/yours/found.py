"""What a diagnosis found, as a user's simulator can use it: a factor on its friction, and pushes, at a state."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from station.physics.contact import Array, Contact
from station.physics.model import Model
from station.simulators.planar.commands import Commands
from station.simulators.planar.load import Motion, World
from station.simulators.planar.plate import gravity_at

IMAGE = frozenset({"seen", "delay_s"})
"""The methods of effects that the tool applies itself, when it turns the path into what the camera sees."""
PLATE = frozenset({"attitude"})
"""Those that it has applied to the gravity that a run states."""


class Found:
    """What the recording has more than the simulation, for one run; before anything is found it changes nothing.

    Each method takes the time `t_s`, the block's place `x_m`, `y_m`, heading `yaw_rad` and velocity `vx_m_s`, `vy_m_s`
    in the plate's frame, each a number or an array (n,), and answers with as many. A block with no velocity is at rest.
    `slid_from_s` is when the present slide began (None: at the moment itself), and `rest_from_s` the rest before it
    (None: before the run).

    How the plate really stands is already in the run's gravity, and what the camera does is added to the path by the
    tool: a simulator has only to multiply its friction, and to add the pushes.
    """

    def __init__(self, model: Model, commands: Commands, *, friction: float = 1.0) -> None:
        """Takes the model of what to change, the commands of one run, and a factor on the friction of this run."""
        self._model, self._commands, self._own = model, commands, friction
        self._world = World(commands, model, friction=np.ones(1), shake=np.zeros(1))

    def friction_multiplier(
        self, t_s: ArrayLike, x_m: ArrayLike, y_m: ArrayLike, yaw_rad: ArrayLike = 0.0, vx_m_s: ArrayLike = 0.0,
        vy_m_s: ArrayLike = 0.0, *, slid_from_s: float | None = None, rest_from_s: float | None = None,
    ) -> Array | float:  # fmt: skip
        """The factor on the simulator's coefficient of friction, static at rest and kinetic in motion."""
        if not self._model.acting("friction"):
            return _as_asked(np.full(np.shape(t_s), self._model.mu_s * self._own), t_s)
        contact = self._contact(t_s, x_m, y_m, yaw_rad, vx_m_s, vy_m_s, slid_from_s, rest_from_s)
        return _as_asked(self._own * self._model.friction(contact), t_s)

    def force_per_mass(
        self, t_s: ArrayLike, x_m: ArrayLike, y_m: ArrayLike, yaw_rad: ArrayLike = 0.0, vx_m_s: ArrayLike = 0.0,
        vy_m_s: ArrayLike = 0.0, *, slid_from_s: float | None = None, rest_from_s: float | None = None,
    ) -> Array:  # fmt: skip
        """The push per mass (3,) or (n, 3), m/s², in the plate's frame, beside gravity and friction; +z lifts."""
        if not self._model.acting("push"):
            return np.zeros((*np.shape(t_s), 3))
        contact = self._contact(t_s, x_m, y_m, yaw_rad, vx_m_s, vy_m_s, slid_from_s, rest_from_s)
        pushed = self._model.push(contact)
        return pushed if np.ndim(t_s) else pushed[0]

    def angular_acceleration(
        self, t_s: ArrayLike, x_m: ArrayLike, y_m: ArrayLike, yaw_rad: ArrayLike = 0.0, vx_m_s: ArrayLike = 0.0,
        vy_m_s: ArrayLike = 0.0, *, friction_m_s2: ArrayLike, slid_from_s: float | None = None,
        rest_from_s: float | None = None,
    ) -> Array | float:  # fmt: skip
        """What turns the sliding block about the normal, rad/s²; `friction_m_s2` is its friction force per mass."""
        if not (self._model.acting("spin") or self._model.acting("lever")):
            return _as_asked(np.zeros(np.shape(t_s)), t_s)
        contact = self._contact(t_s, x_m, y_m, yaw_rad, vx_m_s, vy_m_s, slid_from_s, rest_from_s)
        return _as_asked(self._world.driven(contact, np.broadcast_to(friction_m_s2, len(contact))), t_s)

    def _contact(
        self, t_s: ArrayLike, x_m: ArrayLike, y_m: ArrayLike, yaw_rad: ArrayLike, vx_m_s: ArrayLike, vy_m_s: ArrayLike,
        slid_from_s: float | None, rest_from_s: float | None,
    ) -> Contact:  # fmt: skip
        commands, world = self._commands, self._world
        states = np.broadcast_arrays(*(np.atleast_1d(np.asarray(one, dtype=float)) for one in (
            t_s, x_m, y_m, yaw_rad, vx_m_s, vy_m_s
        )))  # fmt: skip
        time_s, x, y, yaw, vx, vy = states
        number = np.clip(np.searchsorted(commands.time_s[0], time_s, side="right") - 1, 0, world.plate.knots - 2)
        row = np.zeros(len(time_s), dtype=np.intp)
        speed = np.hypot(vx, vy)
        began = time_s if slid_from_s is None else np.full(len(time_s), slid_from_s)
        rested = float(commands.time_s[0, 0] - commands.rest_s[0]) if rest_from_s is None else rest_from_s
        blocks = world.blocks(
            row, number, rest_from_s=np.full(len(time_s), rested), slid_from_s=np.where(speed > 0, began, np.inf)
        )
        down = gravity_at(blocks.stretch, time_s)
        way = np.where(speed > 0, np.arctan2(vy, vx), np.arctan2(down.y, down.x))
        return world.contact(blocks, time_s, Motion(x, y, yaw, speed, way), down)


def needs_telling(model: Model, friction: float = 1.0) -> bool:
    """True if only the simulator itself can act on the model: it changes friction or pushes."""
    hooks = {hook for term in model.terms if not term.effect.is_null(term.values) for hook in term.effect.acts_through()}
    return model.mu_s * friction != 1.0 or bool(hooks - IMAGE - PLATE)


def _as_asked(values: Array, like: ArrayLike) -> Array | float:
    """A number where numbers were given."""
    return values if np.ndim(like) else float(np.ravel(values)[0])
