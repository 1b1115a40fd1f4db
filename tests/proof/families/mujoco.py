"""MuJoCo set for friction that holds, slides and stops rightly: elliptic cone, no slip, steps of a millisecond.

Friction's damping b stops a block: below (mu g - pull) / b its speed fades and nothing else. But a contact gives way
along its normal by mu b v times `impratio`'s root, v being the speed: with MuJoCo's own numbers a free box hops from
1 cm/s on and slides with -.8 to +.2 % of its coefficient, on steep plates -5 %. So b is large and `impratio` next to
nothing, which leaves friction to the steps of no slip that come after, with true cones on normal forces that are
settled. The contact is soft, so that no corner lifts: the block leans by 5 mrad, and is read at its sole, which holds.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

from tests.proof.engine_bench import Array, Engine
from tests.proof.engine_family import EngineFamily
from tests.proof.patch_world.world import Contact

STEP_S = 1e-3
SCENE = """<mujoco>
  <option timestep="{step}" gravity="0 0 0" {solver}/>
  <worldbody>
    <geom name="plate" type="plane" size="1 1 0.1"/>
    <body name="block" pos="0 0 {half_height}">
      <freejoint/>
      <geom name="block" type="box" size="{half_x} {half_y} {half_height}" mass="{mass}"/>
    </body>
  </worldbody>
  <contact><pair geom1="plate" geom2="block" condim="3" friction="{mu} {mu} 0 0 0" {contact}/></contact>
</mujoco>
"""


GOOD = {
    "solver": 'cone="elliptic" impratio="0.001" noslip_iterations="50" noslip_tolerance="1e-10" tolerance="1e-12"',
    "contact": 'solref="0.007 1" solimp="0.15 0.151 0.001 0.5 2" solreffriction="-1e-9 -200"',
}
BAD = {"solver": "", "contact": ""}
"""MuJoCo's settings as they come: a soft contact that creeps, with a pyramid for a cone."""


class MujocoBlock:
    """A free box on a plane."""

    def __init__(self, contact: Contact, *, step_s: float = STEP_S, settings: Mapping[str, str] = GOOD) -> None:
        self.step_s = step_s
        self._mj: Any = importlib.import_module("mujoco")
        numbers = {"half_x": contact.half_x, "half_y": contact.half_y, "half_height": 0.5 * contact.height}
        text = SCENE.format(step=step_s, mass=contact.mass, mu=contact.mu, **numbers, **settings)
        self._model: Any = self._mj.MjModel.from_xml_string(text)
        self._data: Any = self._mj.MjData(self._model)
        self._half_height = 0.5 * contact.height
        self._body: int = self._model.body("block").id

    def put(self, x: float, y: float, yaw: float, *, mu: float) -> None:
        """See `Engine`."""
        self._mj.mj_resetData(self._model, self._data)
        self._model.pair_friction[0, :2] = mu
        self._data.qpos[:] = x, y, self._half_height, math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)

    def step(self, pull: Array, force: Array, moment: float) -> None:
        """See `Engine`."""
        self._model.opt.gravity[:] = pull
        self._data.xfrc_applied[self._body] = force[0], force[1], 0.0, 0.0, 0.0, moment
        self._mj.mj_step(self._model, self._data)

    def read(self) -> tuple[float, float, float, float, float, float]:
        """See `Engine`: the middle of the sole. Plain numbers, as the block is read a million times in a session."""
        x, y, _, w, i, j, k = self._data.qpos.tolist()
        vx, vy, _, roll, pitch, spin = self._data.qvel.tolist()
        h = self._half_height
        aside, ahead = h * roll, -h * pitch  # the sole's speed against the middle, along the block's own axes
        return (
            x - 2.0 * h * (i * k + w * j),
            y - 2.0 * h * (j * k - w * i),
            2.0 * math.atan2(k, w),
            vx + ahead * (1.0 - 2.0 * (j * j + k * k)) + aside * 2.0 * (i * j - w * k),
            vy + ahead * 2.0 * (i * j + w * k) + aside * (1.0 - 2.0 * (i * i + k * k)),
            spin,
        )


class Mujoco(EngineFamily):
    """The family of worlds whose contact is MuJoCo's; the module says how."""

    name: ClassVar[str] = "mujoco"
    title: ClassVar[str] = "MuJoCo"
    place: ClassVar[int] = 40
    module: ClassVar[str] = "mujoco"
    number: ClassVar[int] = 0
    full: ClassVar[Mapping[str, int]] = MappingProxyType({**EngineFamily.full, "artefact": 6})

    def engine(self, contact: Contact) -> Engine:
        """See `MujocoBlock`."""
        return MujocoBlock(contact)

    def bad(self, contact: Contact) -> Engine:
        """See BAD."""
        return MujocoBlock(contact, step_s=2e-3, settings=BAD)
