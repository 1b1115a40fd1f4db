"""The runs that are stepped now: their blocks, what acts on them at each step, and the path that comes of it.

Every run has its own time. All are taken one step further together, so that the effects are asked once for all of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from station.physics.contact import Array, Contact
from station.physics.unturned import unturned
from station.simulators.mujoco.osculating import osculating
from station.simulators.mujoco.tilted import Load, TiltedBlock
from station.simulators.planar.asked import Asked
from station.simulators.planar.friction import LimitCurve, Support, setting_off
from station.simulators.planar.load import Blocks, Motion, World
from station.simulators.planar.plate import Index
from station.simulators.planar.rest import Rest

GOES_M_S, STOPS_M_S = 3e-6, 2e-5
"""A block that accelerates above the first speed begins to slide, and one that slows below the second stops."""
SETTLES_S, UNSETTLED = 0.02, 20.0
"""The time after a block is laid down in which it slides only above so many times that speed."""
LATEST_S = 0.03
"""The start of a slide is set at most this long before its detection, s."""
QUIET_S = 0.03
"""The time for which a block must lie before it may be left alone."""
SLIP_M = 1e-5
"""A shorter slip is none: the block settles."""

Bools = NDArray[np.bool_]


class TimedPoses(NamedTuple):
    """One moment of each followed run: run, time and x, y, yaw (a, 3)."""

    row: Index
    time_s: Array
    pose: Array


@dataclass(eq=False)
class Followed:
    """The runs being stepped, (a,) each; `pose` and `rates` (a, 3) are x, y, yaw and their changes."""

    row: Index
    number: Index
    time_s: Array
    step_s: Array
    pose: Array
    rates: Array
    way: Array
    slid_from_s: Array
    rest_from_s: Array
    since_s: Array
    """The time (a,), s, for which each has been stepped."""
    surplus: Array
    """The excess of friction over the load at the last step's beginning, as a share; nan before the first step."""
    over_from_s: Array
    """The time from which the load exceeds friction; inf while it does not."""
    from_position: Array
    """The position (a, 2) where the present slide began."""
    bodies: list[TiltedBlock]

    def select(self, chosen: Index) -> Followed:
        """Returns the runs with the indices `chosen` (b,) among them."""
        return Followed(
            row=self.row[chosen],
            number=self.number[chosen],
            time_s=self.time_s[chosen],
            step_s=self.step_s[chosen],
            pose=self.pose[chosen],
            rates=self.rates[chosen],
            way=self.way[chosen],
            slid_from_s=self.slid_from_s[chosen],
            rest_from_s=self.rest_from_s[chosen],
            since_s=self.since_s[chosen],
            surplus=self.surplus[chosen],
            over_from_s=self.over_from_s[chosen],
            from_position=self.from_position[chosen],
            bodies=[self.bodies[number] for number in chosen.tolist()],
        )

    @property
    def moving(self) -> Bools:
        """True (a,) for each run that slides."""
        return np.isfinite(self.slid_from_s)


class Follower:
    """Steps runs of a world."""

    def __init__(self, world: World, curve: LimitCurve) -> None:
        self._world, self._curve = world, curve
        self._rest = Rest(world, curve)
        model = world.model
        self._creeps, self._spins = bool(model.acting("creep")), model.turns
        # Here the moment acts on a block at rest, and what it takes of the friction is MuJoCo's to find.
        self._unturned = LimitCurve(unturned(model)) if self._spins else curve
        self._shakes = bool(model.acting("shaking"))

    def step(self, runs: Followed) -> Array:
        """Takes one step of every run.

        It returns by how much friction exceeds the load, as a share (a,): below 0 it slides.

        MuJoCo's Euler step is semi-implicit: the load has to be that of the step's beginning (`TwinWorld` says why).
        """
        moving, now = runs.moving, runs.time_s
        blocks = self._blocks(runs)
        speed = np.where(moving, np.hypot(runs.rates[:, 0], runs.rates[:, 1]), 0.0)
        way = np.where(moving, np.arctan2(runs.rates[:, 1], runs.rates[:, 0]), runs.way)
        if not moving.all():
            _, resting = self._rest.excess(blocks, now, runs.pose, way=runs.way)
            way = np.where(moving, way, resting)
        at = Motion(runs.pose[:, 0], runs.pose[:, 1], runs.pose[:, 2], speed, way)
        x, y, normal, contact = self._world.pull(blocks, now, at)
        if contact is not None and self._shakes:
            # The planar simulator does the same: a push that sets a block off lasts as long as the slide.
            push = np.where(moving, np.maximum(blocks.shake, 0.0), blocks.shake) * self._world.model.shaking(contact)
            x, y = x + push * np.cos(contact.down_rad), y + push * np.sin(contact.down_rad)
        turn, held = np.zeros(len(way)), None
        if contact is not None and self._spins:
            held = self._curve.value(contact.facing(way), blocks.friction)
            way = np.where(moving, way, np.arctan2(y, x))  # a moment has no way: a block sets off where the load points
        contact = None if contact is None else contact.facing(way)
        hold = self._hold(contact, blocks, moving)
        if contact is not None and held is not None:
            along = np.where(moving, held * normal, np.hypot(x, y))
            turn = self._world.driven(setting_off(contact), along, np.where(moving, hold.slope * normal, 0.0))
        ellipse = osculating(hold, way)
        thrown = moving & (runs.since_s == 0.0)
        for body, first, fx, fy, fn, spin, along, across, axis in zip(
            runs.bodies, *(part.tolist() for part in (thrown, x, y, normal, turn, *ellipse)), strict=True
        ):
            step = body.begin if first else body.step
            step(Load(pull=(fx, fy, -fn), turn=spin, friction=(along, across), axis_rad=axis))
        held = (hold.value if held is None else held) * normal
        pull = x * np.cos(way) + y * np.sin(way)
        if contact is not None and self._creeps:
            resting = Asked.like(contact, way_rad=contact.down_rad, spare_m_s2=held - pull)
            crept = self._world.model.creep(resting) * runs.step_s[:, None]
            for body, (dx, dy), slides in zip(runs.bodies, crept.tolist(), moving.tolist(), strict=True):
                if not slides:
                    body.shift(dx, dy)
        surplus = 1.0 - pull / np.where(held > 0, held, 1e-12)
        weigh(runs, surplus)
        self._take_note(runs, way)
        return surplus

    def _hold(self, contact: Contact | None, blocks: Blocks, moving: Bools) -> Support:
        """Returns the limit curve that MuJoCo is given, with its slope and bend in the contact's direction."""
        hold = self._curve.at(contact, blocks.friction)
        if contact is None or moving.all():
            return hold
        if self._spins:
            hold = _chosen(moving, hold, self._unturned.at(contact, blocks.friction))
        # Friction may be greater in motion than at rest: such a slip could not get away.
        kinetic = self._curve.at(setting_off(contact), blocks.friction)
        return _chosen(~moving & (kinetic.value > hold.value), kinetic, hold)

    def _blocks(self, runs: Followed) -> Blocks:
        return self._world.blocks(runs.row, runs.number, rest_from_s=runs.rest_from_s, slid_from_s=runs.slid_from_s)

    def _take_note(self, runs: Followed, way: Array) -> None:
        """Notes the blocks' poses after the step, and which of them have begun to slide."""
        before = runs.pose
        runs.pose = np.array([body.pose for body in runs.bodies])
        turned = runs.pose[:, 2] - before[:, 2]
        runs.pose[:, 2] = before[:, 2] + (turned + np.pi) % (2.0 * np.pi) - np.pi
        slower = np.hypot(runs.rates[:, 0], runs.rates[:, 1])
        runs.rates = np.array([body.rates for body in runs.bodies])
        speed = np.hypot(runs.rates[:, 0], runs.rates[:, 1])
        runs.way, runs.time_s = way, runs.time_s + runs.step_s
        runs.since_s = runs.since_s + runs.step_s
        least = np.where(runs.since_s < SETTLES_S, UNSETTLED * GOES_M_S, GOES_M_S)
        begins = ~runs.moving & (speed > least) & (speed > slower)
        # It began when the load exceeded what holds. A block that is thrown, or turned off its place, has no such
        # moment: its speed grows with the square of the time, and began 2 v / a before that speed's, half a step ago.
        since = 0.5 * runs.step_s + 2.0 * runs.step_s * speed / np.maximum(speed - slower, 1e-9)
        over = np.isfinite(runs.over_from_s)
        since = np.where(over, runs.time_s - np.where(over, runs.over_from_s, 0.0), since)
        runs.slid_from_s[begins] = (runs.time_s - np.minimum(since, LATEST_S))[begins]
        runs.from_position[begins] = before[begins, :2]
        ends = self._world.commands.time_s
        last = ends.shape[1] - 2
        while True:
            over = (runs.time_s >= ends[runs.row, runs.number + 1]) & (runs.number < last)
            if not over.any():
                return
            runs.number = runs.number + over


def weigh(runs: Followed, surplus: Array) -> None:
    """Notes when the load came to exceed friction, by linear interpolation from the step before.

    `surplus` (a,) is the excess of friction over the load at this step's beginning, as a share.
    """
    now, crosses = surplus < 0, (surplus < 0) & (runs.surplus >= 0)
    share = np.divide(surplus, surplus - runs.surplus, out=np.zeros_like(surplus), where=crosses)
    crossing = runs.time_s - runs.step_s * share
    begun = np.where(np.isfinite(runs.over_from_s), runs.over_from_s, crossing)
    runs.over_from_s = np.where(now, begun, np.inf)
    runs.surplus = surplus


def _chosen(where: Bools, first: Support, second: Support) -> Support:
    return Support(*(np.where(where, here, there) for here, there in zip(first, second, strict=True)))
