"""The twin as an arm: set-points go out on `twin/target`, joint states come back on `twin/joints`.

It has no clock and no thread: `tick(now_ns)` samples the trajectory at that very moment. So it behaves the same over
the bus in real time and, where the twin lives in the same process, by a wire of its own in simulated time.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from shared.bus import Received
from shared.errors import UserError
from shared.messages import JointState, JointTarget
from station.arm.drivers import DriverLink, JointReading, match_joints
from station.arm.trajectory import JointTrajectory

Array = NDArray[np.float64]


class TwinWire(Protocol):
    """The connection by which set-points get to the twin and its readings come back."""

    def send(self, now_ns: int, position_rad: Array, velocity_rad_s: Array) -> None:
        """Wants the joints there at `now_ns`, moving on at that velocity.

        Args:
            now_ns: the moment, ns of the agent's clock.
            position_rad: (n,) the joints' angles in the order of the arm's joints, rad; never written to again.
            velocity_rad_s: (n,) their velocities, rad/s; never written to again.
        """
        ...

    def read(self) -> JointReading | None:
        """Returns the twin's latest reading in the model's joint order; None before the first."""
        ...

    def fault(self) -> str:
        """Returns why the readings cannot be used, in one sentence; nothing while they can."""
        ...


class BusWire:
    """The wire of a twin that is a process of its own."""

    def __init__(self, link: DriverLink) -> None:
        self._bus = link.bus
        self._model = link.model
        self._order: NDArray[np.intp] | None = None
        self._names: tuple[str, ...] = ()
        self._reading: JointReading | None = None
        self._fault = ""
        self._bus.subscribe("twin/joints", self._receive)

    def send(self, now_ns: int, position_rad: Array, velocity_rad_s: Array) -> None:
        """Publishes set-points for the twin: `position_rad` (n,), rad, and `velocity_rad_s` (n,), rad/s."""
        target = JointTarget(now_ns, tuple(position_rad.tolist()), tuple(velocity_rad_s.tolist()))
        self._bus.publish("twin/target", target)

    def _receive(self, received: Received) -> None:
        state = received.message
        if not isinstance(state, JointState):
            return
        try:
            order = self._joint_order(state.name)
            effort = state.effort_nm or (0.0,) * len(state.name)
            position, velocity, effort = np.array((state.position_rad, state.velocity_rad_s, effort))[:, order]
            self._reading = JointReading(state.stamp_ns, self._model.joint_names, position, velocity, effort)
            self._fault = ""
        except (UserError, ValueError, IndexError) as wrong:
            self._fault = str(wrong)

    def _joint_order(self, names: tuple[str, ...]) -> NDArray[np.intp]:
        if names != self._names or self._order is None:
            self._order, self._names = np.array(match_joints(self._model, names)), names
        return self._order

    def read(self) -> JointReading | None:
        """Returns the latest joint state from the bus in the model's order; None before the first."""
        return self._reading

    def fault(self) -> str:
        """Returns why the latest joint state does not fit the model; nothing if it does."""
        return self._fault


class SimulatedArm:
    """A `Driver` that plays trajectories to the twin."""

    def __init__(self, wire: TwinWire) -> None:
        self._wire = wire
        self._motion: JointTrajectory | None = None
        self._began_ns = 0
        self._held: tuple[Array, Array] | None = None
        """The set-point at which the arm rests: position, and no velocity."""

    def start(self, trajectory: JointTrajectory, *, now_ns: int) -> None:
        """Begins to play the trajectory at `now_ns`."""
        self._motion, self._began_ns = trajectory, now_ns

    def halt(self, *, now_ns: int) -> None:
        """Halts as `Driver.halt` says: the set-point stays where it is."""
        if self._motion is not None:
            self._hold(self._motion.at(now_ns - self._began_ns)[0])
            self._send_held(now_ns)

    def tick(self, now_ns: int) -> None:
        """Sends the trajectory's set-point of this moment.

        After the motion its last set-point is sent at every tick, so that a late twin hears it.
        """
        motion = self._motion
        if motion is None:
            self._send_held(now_ns)
            return
        position, velocity = motion.at(now_ns - self._began_ns)
        self._wire.send(now_ns, position, velocity)
        if now_ns - self._began_ns > motion.duration_ns:
            self._hold(position)

    def _hold(self, position: Array) -> None:
        self._held, self._motion = (position, np.zeros_like(position)), None

    def _send_held(self, now_ns: int) -> None:
        if self._held is not None:
            self._wire.send(now_ns, *self._held)

    def read(self) -> JointReading | None:
        """Returns the latest reading that came over the wire; None before the first."""
        return self._wire.read()

    def fault(self) -> str:
        """Returns the fault of the wire in one sentence; nothing while there is none."""
        return self._wire.fault()

    def close(self) -> None:
        """Forgets the motion, so that no further set-point of it is sent."""
        self._motion = None


def connect(link: DriverLink) -> SimulatedArm:
    """Connects to the twin over the bus."""
    return SimulatedArm(BusWire(link))
