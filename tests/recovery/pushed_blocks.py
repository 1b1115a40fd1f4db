"""A simulated rig on which somebody moves the block in each tilt: a finger pushes it, or the table is tapped."""

from __future__ import annotations

import math
from dataclasses import dataclass

from shared.bus import Received
from shared.messages import RunEvent, Sample
from shared.rig import RigConfig
from station.app import assembly
from station.app.lockstep import Lockstep
from station.arm.tilt_path import TiltStage
from station.simulators.mujoco.influence import BlockState
from station.simulators.mujoco.world import TwinWorld


@dataclass(frozen=True, kw_only=True)
class Disturbance:
    """Moves the block down the plate at a speed, m/s, for a time, s, from a tilt on; `times`, one every `every_s`."""

    at_rad: float
    speed_m_s: float
    for_s: float
    times: int = 1
    every_s: float = 0.2

    def moves(self, since_s: float) -> bool:
        """Returns true while it moves the block, so many seconds after the plate came to the tilt."""
        return since_s % max(self.every_s, self.for_s) < self.for_s and since_s < self.times * max(
            self.every_s, self.for_s
        )


class DisturbedWorld(TwinWorld):
    """The twin's world with a disturbance in each tilt."""

    what: Disturbance
    _since_ns = 0

    def disturb(self, what: Disturbance) -> None:
        """Lets this happen from now on."""
        self.what, self._mechanism.influence = what, Hand(self)

    def advance(self, to_ns: int) -> None:
        """Lets time pass, and takes the block loose that is about to be moved."""
        super().advance(to_ns)
        steep = math.hypot(*self._down) > math.sin(self.what.at_rad)
        self._since_ns = (self._since_ns or to_ns) if steep else 0
        if self._moves and self._loose is None:
            self._unweld()
            self._left_out, self._resting = 0, False

    def take_along(self) -> None:
        """Gives the block the hand's speed, if that moves it now."""
        if self._moves and self._loose is not None:
            x, y = self._down
            self._loose.qvel[:2] = [self.what.speed_m_s / math.hypot(x, y) * part for part in (x, y)]

    @property
    def _down(self) -> tuple[float, float]:
        """The way down in the plate, as long as the tilt's sine."""
        w, x, y, z = self.plate_quaternion()
        return 2.0 * (w * y - x * z), -2.0 * (w * x + y * z)

    @property
    def _moves(self) -> bool:
        return bool(self._since_ns) and self.what.moves((self._time_ns - self._since_ns) * 1e-9)


class Hand:
    """The influence of what moves the block of a world."""

    def __init__(self, world: DisturbedWorld) -> None:
        self._world = world

    def friction(self, state: BlockState) -> float:
        """Returns the factor 1: friction stays as it is."""
        del state
        return 1.0

    def push(self, state: BlockState) -> tuple[float, float]:
        """Gives the block a speed instead of a push."""
        del state
        self._world.take_along()
        return 0.0, 0.0


def samples_of(what: Disturbance | None, *, samples: int, seed: int, limit_s: float) -> list[tuple[Sample, float]]:
    """Runs a session; returns its samples, each with the friction angle, rad, of its contact as it slid."""

    def world(rig: RigConfig, *, seed: int, start_ns: int, stage: TiltStage | None = None) -> TwinWorld:
        made = assembly.twin_world(rig, seed=seed, start_ns=start_ns, stage=stage)
        if what is not None:
            made.__class__ = DisturbedWorld
        if isinstance(made, DisturbedWorld) and what is not None:
            made.disturb(what)
        return made

    rig, plan = assembly.rig_from(None), assembly.plan_from(None, samples=samples, seed=seed)
    session = Lockstep(rig, plan, recording=None, world=world)
    drawn_rad, told = dict[int, float](), list[Sample]()

    def hear(received: Received) -> None:
        message = received.message
        if isinstance(message, Sample):
            told.append(message)
        elif isinstance(message, RunEvent) and message.phase == "SLIP":
            drawn_rad[message.run] = math.atan(session.twin.world.mu_now)

    for topic in ("session/event", "session/sample"):
        session.bus.subscribe(topic, hear)
    session.run(limit_s=limit_s)
    return [(one, drawn_rad.get(one.run, math.nan)) for one in told]
