"""Simulators of a user's own for the tests: a point on the plate, stepped by hand."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from station.physics.contact import Array
from station.simulators.yours.found import Found
from station.simulators.yours.run import Run

STEP_S = 0.004
Simulate = Callable[[Run, Found], Any]


def point_block(mu: float, *, drop: float = 0.0, step_s: float = STEP_S) -> Simulate:
    """A block whose friction falls by a share `drop` when it slides."""

    def simulate(run: Run, found: Found) -> Array:
        t = np.arange(0.0, run.end_s + step_s, step_s)
        gravity = np.column_stack([np.interp(t, run.t_s, axis) for axis in run.gravity_m_s2.T])
        path = np.column_stack([t, np.tile([run.x_m, run.y_m, run.yaw_rad], (len(t), 1))])
        place, v, began = path[0, 1:3], np.array([run.vx_m_s, run.vy_m_s]), 0.0
        for k, g in enumerate(gravity[:-1]):
            began = began if v.any() else float(t[k])
            factor = found.friction_multiplier(
                t_s=t[k], x_m=place[0], y_m=place[1], vx_m_s=v[0], vy_m_s=v[1], slid_from_s=began
            )
            friction = mu * factor * ((1.0 - drop) if v.any() else 1.0)
            pushed = v + step_s * g[:2]
            faster = pushed * max(0.0, 1.0 + step_s * friction * g[2] / max(np.hypot(*pushed), 1e-12))
            place, v = place + 0.5 * step_s * (v + faster), faster
            path[k + 1, 1:3] = place
        return path

    return simulate


SCENE = """<mujoco model="mine">
  <option timestep="0.002" cone="elliptic" impratio="50000" tolerance="1e-11"/>
  <worldbody>
    <geom name="plate" type="plane" size="1 1 0.01" friction="{mu} 0.005 0.0001"/>
    <body name="cube" pos="0 0 0.005">
      <freejoint/>
      <inertial pos="0 0 0" mass="0.008" diaginertia="100 100 100"/>
      <geom type="sphere" pos="0 0 -0.0045" size="0.0005" friction="{mu} 0.005 0.0001"
            solref="0.007 1" solimp="0.15 0.151 0.001 0.5 2"/>
    </body>
  </worldbody>
</mujoco>
"""
"""A block on one foot, too inert to rock, with a contact that neither creeps nor hops (mujoco/contact.py)."""

SOFT_BOX = """<mujoco model="soft">
  <worldbody>
    <geom name="plate" type="plane" size="1 1 0.01" friction="{mu} 0.005 0.0001"/>
    <body name="cube" pos="0 0 0.005">
      <freejoint/>
      <geom type="box" size="0.005 0.005 0.005" mass="0.008" friction="{mu} 0.005 0.0001"/>
    </body>
  </worldbody>
</mujoco>
"""
"""A box with MuJoCo's own contact and cone, which creeps by millimetres: no physics, but its settings."""
