"""Applies a model to one block at each step: a coefficient of friction, a force per mass and a turning.

Engines know friction that opposes the motion, mu N. A limit curve h(φ) also pulls sideways, by −h′(φ) N across the
way: that, the pushes and what the plate's true attitude adds to gravity make up the force. At rest the coefficient is
the largest load over N that the curve holds in the load's direction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from station.export.carried.corners import stronger
from station.export.carried.watch import GOES_M_S, Moment, Watch
from station.physics.contact import Array, Contact, unit
from station.physics.dissipation import support, threshold
from station.physics.model import Model
from station.physics.sole import SQUARE_GYRATION
from station.physics.turned import seen_turned
from station.physics.unturned import unturned
from station.simulators.planar.slide import relaxed


class Action(NamedTuple):
    """The actions on the block until the next step.

    `mu` is for an engine's friction, `force` (3,), m/s², in P, comes on top of the engine's gravity; `turn`, rad/s², is
    about the plate's normal. `load` (2,) and `normal` (m/s²) are the whole pull along the plate, and across it.
    """

    mu: float
    force: Array
    turn: float
    moving: bool
    load: Array
    normal: float


@dataclass
class Law:
    """A model at work on one block, in one run.

    `strength` is this run's factor on friction and `shake` its share of shaking: see `law_of_run`. `corners_below_m` is
    how far the mass is above the four corners by which the engine's block touches, if it does: see `corners`.
    """

    model: Model
    watch: Watch
    strength: float = 1.0
    shake: float = 0.0
    corners_below_m: float = math.nan

    def __post_init__(self) -> None:
        """Leaves to the engine what the moment on a block at rest takes of its friction: there it acts by itself."""
        self._still = unturned(self.model) if self.model.turns else self.model
        self._way, self._held = 0.0, 0.0

    def act(self, now: Moment, *, step_s: float) -> Action:
        """Returns the actions from `now` on for `step_s`; call it once a step, in the order of time."""
        self.watch.take(now)
        gravity = self._true_gravity(now)
        load, normal, pushed = self._load(gravity, shake=self.shake if not self.watch.moving else max(self.shake, 0.0))
        was_moving = self.watch.moving
        if not self.watch.slides(excess=self._excess(load, normal, gravity)):
            return self._at_rest(now, (load, normal, pushed), gravity)
        if not was_moving:
            load, normal, pushed = self._load(gravity, shake=max(self.shake, 0.0))
        return self._sliding(now, (load, normal, pushed), gravity, step_s)

    def creep(self) -> Array:
        """Returns the velocity (2,), m/s, in P, at which the model lets a block at rest creep."""
        gravity = self._true_gravity(self.watch.last)
        load, normal, _ = self._load(gravity, shake=self.shake)
        spare = -np.atleast_1d(self._excess(load, normal, gravity))
        resting = self.watch.contact(way_rad=self._way_of(gravity), gravity=gravity)
        return self.model.creep(replace(resting, spare_m_s2=spare))[0]

    # --- the load ---------------------------------------------------------------------------------------------------

    def _true_gravity(self, now: Moment) -> Array:
        if not self.model.acting("attitude"):
            return now.gravity
        level = self.watch.contact(way_rad=math.atan2(now.gravity[1], now.gravity[0]))
        return seen_turned(now.gravity, self.model.attitude(level)[0])

    def _load(self, gravity: Array, *, shake: float) -> tuple[Array, float, Array]:
        """Gives pull along the plate (2,), normal force per mass, and what pulls beside true gravity (3,); all m/s²."""
        state = self.watch.contact(way_rad=self._way_of(gravity), gravity=gravity)
        pushed = self.model.push(state)[0]
        if self.model.acting("shaking"):
            pushed = pushed + shake * self.model.shaking(state)[0] * np.append(state.down[0], 0.0)
        total = gravity + pushed
        return total[:2], max(-float(total[2]), 0.0), pushed

    def _way_of(self, gravity: Array) -> float:
        """Returns the direction of the slide; at rest that of the load."""
        now = self.watch.last
        if not self.watch.moving:
            return math.atan2(gravity[1], gravity[0])
        return math.atan2(now.velocity[1], now.velocity[0]) if now.speed_m_s > GOES_M_S else self._way

    def _excess(self, load: Array, normal: float, gravity: Array) -> float:
        """Gives the excess of the load over friction, m/s²: of a block at rest, or along the way of one that slides."""
        way = self._way_of(gravity)
        state = self.watch.contact(way_rad=way, gravity=gravity)
        if self.watch.moving:
            held = self.strength * float(self.model.friction(state)[0])
            return float(load @ unit(np.array([way]))[0]) - held * normal
        self._held, self._way = self._threshold(self.model, state, load)
        return math.hypot(*load) - self._held * normal

    def _threshold(self, model: Model, state: Contact, load: Array) -> tuple[float, float]:
        """Returns the largest load over N that holds against one in this direction, and the slip's direction, rad."""
        held, slip = threshold(model, state, np.array([math.atan2(load[1], load[0])]))
        return self.strength * float(held[0]), float(slip[0])

    # --- what acts --------------------------------------------------------------------------------------------------

    def _at_rest(self, now: Moment, pull: tuple[Array, float, Array], gravity: Array) -> Action:
        load, normal, pushed = pull
        direction = math.atan2(load[1], load[0])
        state = self.watch.contact(way_rad=direction, gravity=gravity)
        turn = self._turn(replace(state, moving=np.ones(1, dtype=bool)), math.hypot(*load), 0.0, normal)
        mu = self._held if self._still is self.model else self._threshold(self._still, state, load)[0]
        return Action(mu, gravity - now.gravity + pushed, turn, False, load, normal)

    def _sliding(self, now: Moment, pull: tuple[Array, float, Array], gravity: Array, step_s: float) -> Action:
        load, normal, pushed = pull
        way = np.array([self._way_of(gravity)])
        state = self.watch.contact(way_rad=float(way[0]), gravity=gravity)
        here, slope, bend = (self.strength * part for part in support(self.model, state, way))
        ahead, aside = load @ unit(way)[0], load @ unit(way + np.pi / 2)[0]
        # The direction of a slow block settles faster than a step lasts: the step has the force of its end.
        turn = relaxed(ahead + bend * normal, aside - slope * normal, np.array([now.speed_m_s]), np.array([step_s]))
        self._way = float((way + turn)[0])
        mu = float((here + turn * (slope + 0.5 * turn * bend))[0])
        sideways = -float((slope + turn * bend)[0]) * normal * unit(way + turn + np.pi / 2)[0]
        force = gravity - now.gravity + pushed + np.append(sideways, 0.0)
        return Action(mu, force, self._turn(state, mu * normal, float(slope[0]) * normal, normal), True, load, normal)

    def _turn(self, state: Contact, along: float, across: float, normal: float) -> float:
        """Gives the angular acceleration by spin and by friction per mass, m/s², along and across; corners add."""
        area = float(state.area_m2[0])
        moment = float(self.model.moment(state, np.array([along]), across)[0])
        turn = float(self.model.spin(state)[0]) + moment / (SQUARE_GYRATION * area)
        if not (turn and self.corners_below_m > 0):
            return turn
        return turn * stronger(self.corners_below_m * along / max(normal, 1e-9), side_m=math.sqrt(area))


def law_of_run(model: Model, watch: Watch, rng: np.random.Generator) -> Law:
    """Returns the law of one run, with friction and shaking of its own, drawn as the model scatters."""
    strength, shake = rng.standard_normal(2)
    return Law(model, watch, strength=math.exp(model.scatter * strength), shake=float(shake))
