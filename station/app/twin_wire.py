"""The arm's wire to a twin in the same process: what else goes over the bus as messages that nobody records."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from station.arm.drivers import JointReading
from station.simulators.mujoco.world import TwinWorld

Array = NDArray[np.float64]


class DirectWire:
    """A `TwinWire` that hands set-points to a world and reads its joints, with the values that the bus would carry."""

    def __init__(self, world: TwinWorld) -> None:
        self._world = world
        self._names = world.arm.joint_names

    def send(self, now_ns: int, position_rad: Array, velocity_rad_s: Array) -> None:
        """Hands set-points to the world: `position_rad` (n,), rad, and `velocity_rad_s` (n,), rad/s."""
        self._world.set_target(position_rad, velocity_rad_s, stamp_ns=now_ns)

    def read(self) -> JointReading:
        """Returns the reading of the joints' sensors at the world's time."""
        return JointReading(self._world.time_ns, self._names, *self._world.joint_arrays())

    def fault(self) -> str:
        """Returns an empty text: nothing can come between."""
        return ""
