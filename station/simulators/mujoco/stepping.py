"""The physics of a loose block in the twin: it is always stepped, and each step has the load of its own beginning.

MuJoCo's Euler step is semi-implicit, v' = v + h a and x' = x + h v'. The places' second difference h² a stands for the
acceleration at the step's beginning, so the load has to be that of this moment: that of the step's middle would make
every path come 1 ms too early (tests/recovery/test_time_of_paths.py). A velocity is that of half a step before.

What may be skipped is said elsewhere (`savings`), by whoever calls this.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from station.simulators.mujoco.engine import BlockEngine
from station.simulators.mujoco.grip import PlateMotion
from station.simulators.mujoco.influence import BlockState, Influence, Slides, times
from station.simulators.mujoco.specimen import FrictionDraw

STEP_NS = 2_000_000
STEP_S = STEP_NS * 1e-9
SETTLING, GRIPPED = 25, 10.0
"""Steps (50 ms), and factor on the friction, with which a block sinks into its place before it is let go:
without them it slips by 15 µm as its feet sink in, which is more than the camera's noise."""


class Mechanism:
    """A world's influence, if it has one, with what it is told: since when a block lies, and how often it slid."""

    def __init__(self, influence: Influence | None, *, start_ns: int) -> None:
        self.influence, self.slides, self.slid_ns = influence, 0, start_ns
        self._sliding = Slides()

    def let_go(self) -> None:
        """Notes that a block is no part of the plate any more; it does not slide yet."""
        self._sliding = Slides()

    def act(self, block: BlockEngine, draw: FrictionDraw, *, now_ns: int) -> tuple[float, float]:
        """Sets the block's friction for the coming step; gives the further pull along the plate, m/s²."""
        if self.influence is None:
            return 0.0, 0.0
        position, velocity = block.qpos[:3].tolist(), block.qvel[:3].tolist()
        if self._sliding.take(math.hypot(velocity[0], velocity[1])):
            self.slid_ns = now_ns
        state = self._state(position, velocity, now_ns=now_ns)
        block.set_friction(times(draw, self.influence.friction(state)))
        return self.influence.push(state)

    def at_rest(self, draw: FrictionDraw, position: Sequence[float], *, now_ns: int) -> FrictionDraw:
        """Returns the friction of a block that lies at `position`."""
        if self.influence is None:
            return draw
        still = replace(self._state(position, (0.0, 0.0), now_ns=now_ns), sliding=False)
        return times(draw, self.influence.friction(still))

    def _state(self, position: Sequence[float], velocity: Sequence[float], *, now_ns: int) -> BlockState:
        return BlockState(
            place_m=(position[0], position[1]),
            velocity_m_s=(velocity[0], velocity[1]),
            sliding=self._sliding.now,
            lain_s=max(0, now_ns - self.slid_ns) * 1e-9,
            slides=self.slides,
        )


def step(block: BlockEngine, motion: PlateMotion, *, ago_s: float, further: tuple[float, float]) -> None:
    """Steps a block once, from `ago_s` before the look's end, under the plate's pull and a further one (m/s²)."""
    x, y, z = motion.pull(block.qpos[:3].tolist(), block.qvel[:3].tolist(), ago_s=ago_s, step_s=STEP_S)
    block.step(1, pull=(x + further[0], y + further[1], z), step_s=STEP_S)


def settle(block: BlockEngine, motion: PlateMotion, draw: FrictionDraw) -> None:
    """Lets a block's feet sink in under the present pull while it cannot slip, and takes the velocity that is left."""
    pull = motion.pull(block.qpos[:3].tolist(), (0.0, 0.0, 0.0), ago_s=0.0, step_s=STEP_S)
    block.set_friction(times(draw, GRIPPED))
    for _ in range(SETTLING):
        block.step(1, pull=pull, step_s=STEP_S)
    block.qvel[:] = 0.0
    block.set_friction(draw)
