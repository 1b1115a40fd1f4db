"""The arm's own angle (the paper's "internal sensors"): forward kinematics, from `arm/platform` on the bus.

Its readings are stamped when they are received, on the clock by which all other sources are stamped.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from shared.bus import Received
from shared.config import parse
from shared.messages import PlatformState
from station.angles.frames import gravity_of_attitude, mount_rotation, on_plate
from station.angles.reading import Reading, Vector, reading_of_gravity
from station.angles.sources import SourceLink

ON_DEMAND = False
_KEPT = 10_000


@dataclass(frozen=True, kw_only=True)
class KinematicsOptions:
    """`mount_rpy_deg`: how the real plate is turned against the plate of the arm's model, when that was measured."""

    mount_rpy_deg: Vector = (0.0, 0.0, 0.0)


class KinematicsSource:
    """An `AngleSource` that listens to the arm agent."""

    def __init__(self, link: SourceLink) -> None:
        self._plate_from_sensor = mount_rotation(parse(KinematicsOptions, link.options).mount_rpy_deg)
        self._waiting: deque[tuple[int, PlatformState]] = deque(maxlen=_KEPT)
        link.bus.subscribe("arm/platform", self._receive)

    def _receive(self, received: Received) -> None:
        if isinstance(received.message, PlatformState):
            self._waiting.append((received.receive_ns, received.message))

    def open(self) -> None:
        """Does nothing: the bus is open already."""

    def read(self) -> tuple[Reading, ...]:
        """Returns a reading for each state of the plate that the arm agent has sent since the last call."""
        return tuple(self._reading(*self._waiting.popleft()) for _ in range(len(self._waiting)))

    def _reading(self, stamp_ns: int, state: PlatformState) -> Reading:
        gravity = gravity_of_attitude(state.qw, state.qx, state.qy, state.qz)
        return reading_of_gravity(on_plate(gravity, plate_from_sensor=self._plate_from_sensor), stamp_ns=stamp_ns)

    def close(self) -> None:
        """Does nothing: the bus belongs to the station."""


def connect(link: SourceLink) -> KinematicsSource:
    """Returns the source for a table of rig.toml."""
    return KinematicsSource(link)
