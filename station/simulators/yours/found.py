"""Gives a diagnosis's findings as a user's simulator can use them: a factor on its friction, and pushes, at a state."""

from __future__ import annotations

from typing import Required, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from station.physics.contact import Array, Contact
from station.physics.effect import HOOKS
from station.physics.model import Model
from station.simulators.own_level import without_own_level
from station.simulators.planar.commands import Commands
from station.simulators.planar.load import Motion, World
from station.simulators.planar.plate import gravity_at

IMAGE = frozenset({"seen", "delay_s"})
"""The methods of effects that the tool applies itself, when it turns the path into what the camera sees."""
PLATE = frozenset({"attitude", "motion"})
"""The methods that it has applied to the gravity and the plate's motion that a run states."""


class State(TypedDict, total=False):
    """A state of the block in the plate's frame, each a number or an array (n,); only `t_s` must be there.

    What is left out of the place is that at the run's beginning; of the velocity, 0. `slid_from_s` is when the present
    slide began (left out: at the moment itself), and `rest_from_s` the rest before it (left out: before the run).
    """

    t_s: Required[ArrayLike]
    x_m: ArrayLike
    y_m: ArrayLike
    yaw_rad: ArrayLike
    vx_m_s: ArrayLike
    vy_m_s: ArrayLike
    slid_from_s: ArrayLike
    rest_from_s: ArrayLike


class Found:
    """The corrections of the simulation for one run; before anything is found it changes nothing.

    Each method takes a `State` by its names, and answers with a number (or a vector) for each moment. How the plate
    really stands is already in the run's gravity, and what the camera does is added to the path by the tool: a
    simulator has only to multiply its friction, and to add the pushes.
    """

    def __init__(self, model: Model, commands: Commands, *, friction: float = 1.0) -> None:
        """Takes the model of what to change, the commands of one run, and a factor on the friction of this run."""
        model, level = without_own_level(model, float(commands.run[0]))
        self._model, self._commands, self._own = model, commands, friction * level
        self._world = World(commands, model, friction=np.ones(1), shake=np.zeros(1))

    def friction_multiplier(self, **state: Unpack[State]) -> Array | float:
        """Gives the factor (n,), or one, on the simulator's friction coefficient, static at rest, kinetic in motion."""
        if self._model.acting("friction"):
            return _as_asked(self._own * self._model.friction(self._contact(state)), state["t_s"])
        factor = self._model.mu_s * self._own
        return np.full(np.shape(state["t_s"]), factor) if np.ndim(state["t_s"]) else factor

    def force_per_mass(self, **state: Unpack[State]) -> Array:
        """Gives the push per mass (3,) or (n, 3), m/s², in the plate's frame, beside gravity and friction; +z lifts."""
        if not self._model.acting("push"):
            return np.zeros((*np.shape(state["t_s"]), 3))
        pushed = self._model.push(self._contact(state))
        return pushed if np.ndim(state["t_s"]) else pushed[0]

    def angular_acceleration(self, *, friction_m_s2: ArrayLike, **state: Unpack[State]) -> Array | float:
        """Gives the angular acceleration (n,), rad/s², of a sliding block; `friction_m_s2` (n,): friction per mass."""
        if not self._model.turns:
            return _as_asked(np.zeros(np.shape(state["t_s"])), state["t_s"])
        contact = self._contact(state)
        force = np.broadcast_to(np.asarray(friction_m_s2, dtype=float), (len(contact),))
        return _as_asked(self._world.driven(contact, force), state["t_s"])

    def _contact(self, state: State) -> Contact:
        commands, world = self._commands, self._world
        x0, y0, yaw0 = commands.start[0].tolist()
        usual = {"x_m": x0, "y_m": y0, "yaw_rad": yaw0, "vx_m_s": 0.0, "vy_m_s": 0.0}
        usual |= {"slid_from_s": state["t_s"], "rest_from_s": float(commands.rest_from_s[0])}
        values = [np.atleast_1d(np.asarray(one, dtype=float)) for one in ({**usual, **state}[name] for name in _ORDER)]
        time_s, x, y, yaw, vx, vy, slid, rest_from_s = np.broadcast_arrays(*values)
        number = np.clip(np.searchsorted(commands.time_s[0], time_s, side="right") - 1, 0, world.plate.knots - 2)
        speed = np.hypot(vx, vy)
        row = np.zeros(len(time_s), dtype=np.intp)
        slid_from_s = np.where(speed > 0, slid, np.inf)
        blocks = world.blocks(row, number, rest_from_s=rest_from_s, slid_from_s=slid_from_s)
        down = gravity_at(blocks.stretch, time_s)
        way = np.where(speed > 0, np.arctan2(vy, vx), np.arctan2(down.y, down.x))
        return world.contact(blocks, time_s, Motion(x, y, yaw, speed, way), down)


_ORDER = tuple(State.__annotations__)


def needs_telling(model: Model, friction: float = 1.0) -> bool:
    """Returns true if only the simulator itself can act on the model: it changes friction or pushes."""
    acting = {hook for hook in HOOKS if model.acting(hook)}
    return model.mu_s * friction != 1.0 or bool(acting - IMAGE - PLATE)


def _as_asked(values: Array, like: ArrayLike) -> Array | float:
    """Returns a number where numbers were given."""
    return values if np.ndim(like) else float(np.ravel(values)[0])
