"""The load on the block besides friction: gravity, the turning plate, the foam and the effects' pushes, per mass.

In P, with the block's place r and velocity v, the plate's rate ω and acceleration α, and the pivot's acceleration A:

    a = g − A − α × r − ω × (ω × r) − 2 ω × v + pushes,    N/m = −a_z

(Goldstein, Classical Mechanics, section 4.10). The pivot is at the plate's centre, at the height of the block. The foam
is a spring and a damper that never pull; where a run begins with the block in it, it has given way to the block, and
pushes only when that goes deeper.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from station.physics.circle import cos_sin
from station.physics.contact import Array, Contact
from station.physics.model import Model
from station.physics.reversals import SWINGS
from station.physics.sole import SQUARE_GYRATION
from station.simulators.planar.asked import Asked
from station.simulators.planar.commands import Commands
from station.simulators.planar.plate import Column, Down, Index, Plate, gravity_at

FOAM_N_M = 120.0
FOAM_DAMPING = 0.8
"""Stiffness of the border against one side of the block (two corners), and its damping as a share of critical."""

_OWN = ("run", "mass_kg", "area_m2", "mount_rad", "temperature_c", "relative_humidity")


class Pull(NamedTuple):
    """Tangential load and normal force per mass (a,), m/s², and the contact if any effect asks for it."""

    x: Array
    y: Array
    normal: Array
    contact: Contact | None


class Motion(NamedTuple):
    """Places and motion of blocks (a,): direction `way`, turned by `yaw`; a block that turns has a yaw rate."""

    x: Array
    y: Array
    yaw: Array
    speed: Array
    way: Array
    yaw_rate: Array | float = 0.0


@dataclass(frozen=True, eq=False)
class Blocks:
    """Some of the runs: which, on which stretch, and `own` (6, a), what does not change within a run."""

    row: Index
    number: Index
    stretch: Array
    own: Array
    friction: Array
    shake: Array
    rest_from_s: Array
    """The time at which the present rest began; while sliding, that of the rest before it."""
    slid_from_s: Array
    """The time at which the present slide began; inf at rest."""

    def select(self, chosen: Index) -> Blocks:
        """Returns the blocks with the indices `chosen` (b,)."""
        return Blocks(
            self.row[chosen],
            self.number[chosen],
            self.stretch[:, chosen],
            self.own[:, chosen],
            self.friction[chosen],
            self.shake[chosen],
            self.rest_from_s[chosen],
            self.slid_from_s[chosen],
        )


class World:
    """The runs of a batch with a model: makes `Blocks`, and says what pulls them."""

    def __init__(self, commands: Commands, model: Model, *, friction: Array, shake: Array) -> None:
        self.commands, self.model, self.plate = commands, model, Plate(commands, model)
        self._friction, self._shake = friction, shake
        self._own = np.stack([getattr(commands, name) for name in _OWN])
        self.half_m = 0.5 * np.sqrt(commands.area_m2)
        self._opening = commands.opening
        self.walled = self._opening.walled
        hooks = ("friction", "push", "spin", "lever", "creep", "shaking")
        self._dented_m = np.zeros(len(commands))
        if self.walled:
            x, y, yaw = commands.start.T
            self._dented_m = np.minimum(self._free_m(np.arange(len(commands)), x, y, yaw), 0.0)
        self.needs_contact = any(model.acting(hook) for hook in hooks)
        self.pushed = bool(model.acting("push"))
        self._twists = bool(commands.rate_rad_s[..., 2].any())
        self._jerks = bool(commands.acceleration_rad_s2.any())
        self._strays = bool(commands.pivot_m_s2.any())

    def blocks(self, row: Index, number: Index, *, rest_from_s: Array, slid_from_s: Array | None = None) -> Blocks:
        """Gives blocks in some runs, at rest unless it is said since when they slide.

        Args:
            row: (a,) the indices of their runs.
            number: (a,) the numbers of their stretches.
            rest_from_s: (a,) since when they rest, s of each run, as in `Blocks`.
            slid_from_s: (a,) since when they slide, s of each run, as in `Blocks`.
        """
        slid = np.full(len(row), np.inf) if slid_from_s is None else slid_from_s
        stretch, own = self.plate.stretch(row, number), self._own[:, row]
        return Blocks(row, number, stretch, own, self._friction[row], self._shake[row], rest_from_s, slid)

    def moved_on(self, blocks: Blocks, going: Index) -> Blocks:
        """Returns the same blocks, of which those with the indices `going` (b,) go on to the next stretch."""
        number, stretch = blocks.number.copy(), blocks.stretch.copy()
        number[going] += 1
        stretch[:, going] = self.plate.stretch(blocks.row[going], number[going])
        return replace(blocks, number=number, stretch=stretch)

    def pull(self, blocks: Blocks, time_s: Array, at: Motion, heading: tuple[Array, Array] | None = None) -> Pull:
        """Gives the load at times `time_s` (a,), s; `heading` is cos and sin of the motion's way, if known already."""
        down = gravity_at(blocks.stretch, time_s)
        x, y, normal = self._inertial(blocks.stretch, down, at, heading or cos_sin(at.way))
        border = None
        if self.walled:
            border = self.border_m(blocks.row, at)
            foam_x, foam_y = self._foam(border, blocks, at)
            x, y = x + foam_x, y + foam_y
        contact = self.contact(blocks, time_s, at, down, border) if self.needs_contact else None
        if contact is not None and self.pushed:
            push = self.model.push(contact)
            x, y, normal = x + push[:, 0], y + push[:, 1], normal - push[:, 2]
        return Pull(x, y, np.maximum(normal, 0.0), contact)

    def _inertial(
        self, stretch: Array, down: Down, at: Motion, heading: tuple[Array, Array]
    ) -> tuple[Array, Array, Array]:
        wx, wy, wz = stretch[Column.RATE : Column.RATE + 3]
        vx, vy = at.speed * heading[0], at.speed * heading[1]
        inward = wx * at.x + wy * at.y
        square = wx * wx + wy * wy
        x = down.x + square * at.x - wx * inward
        y = down.y + square * at.y - wy * inward
        z = down.z + 2.0 * (wy * vx - wx * vy)
        if self._twists:
            x = x + wz * (wz * at.x + 2.0 * vy)
            y = y + wz * (wz * at.y - 2.0 * vx)
            z = z - wz * inward
        if self._jerks:
            ax, ay, az = stretch[Column.ACCELERATION : Column.ACCELERATION + 3]
            x, y, z = x + az * at.y, y - az * at.x, z + ay * at.x - ax * at.y
        if self._strays:
            ax, ay, az = stretch[Column.PIVOT : Column.PIVOT + 3]
            x, y, z = x - ax, y - ay, z - az
        return x, y, -z

    def driven(self, contact: Contact, along: Array, across: Array | float = 0.0) -> Array:
        """Returns the angular acceleration (a,), rad/s², by spin and by the moment of friction.

        Args:
            contact: the blocks.
            along: (a,) the friction per mass against the way, m/s², see `Model.moment`.
            across: (a,) the friction per mass to its right, m/s².
        """
        moment = self.model.moment(contact, along, across)
        return self.model.spin(contact) + moment / (SQUARE_GYRATION * contact.area_m2)

    def border_m(self, row: Index, at: Motion) -> Array:
        """Returns the distance (a,), m, of the block's outermost corner from the foam, in runs `row` (a,).

        It is inf without foam.
        """
        if not self.walled:
            return np.full(len(row), np.inf)
        return self._free_m(row, at.x, at.y, at.yaw) - self._dented_m[row]

    def _free_m(self, row: Index, x: Array, y: Array, yaw: Array) -> Array:
        return self._opening.room_m(self.half_m[row], (x, y, yaw))

    def _foam(self, border_m: Array, blocks: Blocks, at: Motion) -> tuple[Array, Array]:
        """Returns the foam's push into the opening."""
        touching = border_m < 0
        if not touching.any():
            return np.zeros(len(border_m)), np.zeros(len(border_m))
        stiffness = FOAM_N_M / blocks.own[1]
        ux, uy = -self._opening.inward(self.half_m[blocks.row], (at.x, at.y, at.yaw)).T
        outward = at.speed * (np.cos(at.way) * ux + np.sin(at.way) * uy)
        size = -stiffness * border_m + 2.0 * FOAM_DAMPING * np.sqrt(stiffness) * outward
        size = np.where(touching, np.maximum(size, 0.0), 0.0)
        return -size * ux, -size * uy

    def contact(self, blocks: Blocks, time_s: Array, at: Motion, down: Down, border_m: Array | None = None) -> Contact:
        """Returns the contact that the effects are given.

        Args:
            blocks: the blocks.
            time_s: (a,) the times, s.
            at: their motion.
            down: the direction of gravity in the plate, and what follows from it.
            border_m: (a,) what the method of this name says, m, of whoever has it already.
        """
        stretch, moving = blocks.stretch, np.isfinite(blocks.slid_from_s)
        run, mass, area, mount, temperature, humidity = blocks.own
        known = {
            "run": run,
            "moving": moving,
            "way_rad": at.way,
            "speed_m_s": at.speed,
            "x_m": at.x,
            "y_m": at.y,
            "yaw_rad": at.yaw,
            "rate_rad_s": stretch[Column.RATE : Column.RATE + 3].T,
            "acceleration_rad_s2": stretch[Column.ACCELERATION : Column.ACCELERATION + 3].T,
            "rising": stretch[Column.RISING],
            "swing_rad": stretch[Column.SWING : Column.SWING + SWINGS].T,
            "mount_rad": mount,
            "mass_kg": mass,
            "area_m2": area,
            "temperature_c": temperature,
            "relative_humidity": humidity,
        }
        later = {
            "rest_s": lambda: np.where(moving, blocks.slid_from_s, time_s) - blocks.rest_from_s,
            "slid_s": lambda: np.maximum(time_s - blocks.slid_from_s, 0.0),
            "tilt_rad": lambda: np.arctan2(np.sqrt(down.x * down.x + down.y * down.y), -down.z),
            "down_rad": lambda: np.arctan2(down.y, down.x),
            "gone_rad": lambda: np.abs(
                np.arctan2(np.sqrt(down.x * down.x + down.y * down.y), -down.z) - stretch[Column.TURNED]
            ),
            "step_s": lambda: time_s - stretch[Column.STEP_BEGIN],
            "border_m": lambda: self.border_m(blocks.row, at) if border_m is None else border_m,
            "spare_m_s2": lambda: np.full(len(moving), np.nan),
        }
        return Asked.of(known, later)
