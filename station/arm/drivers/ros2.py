"""Arms under ROS 2 with a joint_trajectory_controller, over Zenoh as rmw_zenoh speaks it; no ROS needed here.

A motion is one trajectory_msgs/JointTrajectory; a halt is a trajectory of one point, the last measured pose. Checked:
type hashes against the published ones, keys and bytes against two independent implementations (zenoh_ros2_sdk,
pycdr2) where they are installed, and motions against an arm of our own on a Zenoh router. Not tried against a live
ROS 2 or a real arm.

`[arm.options]`: `router` (where rmw_zenohd listens), `domain` (ROS_DOMAIN_ID), `trajectory` and `joint_states`
(topics), `answer_timeout_s` (how long to look for the controller).

A topic says nothing back: a motion that the controller refuses shows only as an arm that does not follow, and the
safety gate stops it. The robot's clock may show any time (`_robot_clock`).
"""

from __future__ import annotations

import contextlib
import time
import uuid
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shared.config import parse
from shared.errors import UserError
from shared.zenoh_bus import RawSession
from station.arm.drivers import DriverLink, JointReading
from station.arm.drivers import _ros2_wire as wire
from station.arm.drivers._joint_states import JointStates
from station.arm.drivers._robot_clock import Arrivals
from station.arm.trajectory import JointTrajectory

Array = NDArray[np.float64]
_NODE = "repose_arm"
_HALT_NS = 100_000_000
_STATES = 100
"""Joint states that may wait for a tick: those of 0.2 s at 500 Hz, the quickest arms' rate."""
_AGAIN_S = 0.1
"""The wait before the graph is asked again for a controller that has not shown up."""


@dataclass(frozen=True, kw_only=True)
class Ros2Options:
    """The `[arm.options]` table for this driver."""

    router: str = "tcp/127.0.0.1:7447"
    domain: int = 0
    trajectory: str = "/joint_trajectory_controller/joint_trajectory"
    joint_states: str = "/joint_states"
    answer_timeout_s: float = 3.0


class Ros2Arm:
    """A `Driver` over ROS 2. Zenoh's thread only enqueues; `tick` takes what it left."""

    def __init__(self, link: DriverLink) -> None:
        self._model = link.model
        self._options = parse(Ros2Options, link.options)
        self._bus = link.bus
        self._heard: deque[tuple[int, bytes]] = deque(maxlen=_STATES)
        """The payloads that wait for a tick, each behind its moment of arrival."""
        self._states = JointStates(link.model)
        self._sequence = 0
        self._writer = uuid.uuid4().bytes
        self._session = RawSession(connect=[self._options.router])
        domain = self._options.domain
        self._key = wire.data_key(self._options.trajectory, wire.JOINT_TRAJECTORY, domain=domain)
        self._join(domain)

    def _join(self, domain: int) -> None:
        """Shows up in the ROS graph, listens to the joints, and looks for the controller."""
        session, options = self._session, self._options
        session.announce(wire.node_token(session.id, domain=domain, name=_NODE))
        session.announce(
            wire.publisher_token(
                session.id,
                domain=domain,
                node=_NODE,
                entity=1,
                topic=options.trajectory,
                type_name=wire.JOINT_TRAJECTORY,
            )
        )
        session.announce(
            wire.subscriber_token(
                session.id,
                domain=domain,
                node=_NODE,
                entity=2,
                topic=options.joint_states,
                type_name=wire.JOINT_STATE,
            )
        )
        states = wire.data_key(options.joint_states, wire.JOINT_STATE, domain=domain)
        session.subscribe(states, self._note)
        pattern = wire.subscribers_pattern(options.trajectory, wire.JOINT_TRAJECTORY, domain=domain)
        found = self._looked_for(pattern)
        if not found:
            self.close()
            raise UserError(
                f"Nobody on ROS 2 domain {domain} at {options.router} listens to {options.trajectory}: start the "
                "robot's controllers, or correct 'trajectory' or 'domain' in [arm.options] of rig.toml."
            )
        expected = wire.type_hash(wire.JOINT_TRAJECTORY)
        if not any(expected in key for key in found):
            self.close()
            raise UserError(
                f"The controller on {options.trajectory} has another version of {wire.JOINT_TRAJECTORY} than this "
                "program (ROS 2 Jazzy's): it would hear nothing."
            )

    def _note(self, payload: bytes, attachment: bytes) -> None:
        del attachment
        self._heard.append((Arrivals.now(), payload))

    def _looked_for(self, pattern: str) -> list[str]:
        """Returns the keys that match a pattern; a controller may show up until `answer_timeout_s` have passed."""
        timeout_s = self._options.answer_timeout_s
        give_up = time.monotonic() + timeout_s
        while not (found := self._session.announced(pattern, timeout_s=timeout_s)) and time.monotonic() < give_up:
            time.sleep(_AGAIN_S)
        return found

    def start(self, trajectory: JointTrajectory, *, now_ns: int) -> None:
        """Publishes the trajectory; the controller replaces what it was doing."""
        self._publish(
            [
                self._point(int(time_ns), position, velocity)
                for time_ns, position, velocity in zip(
                    trajectory.times_ns, trajectory.position_rad, trajectory.velocity_rad_s, strict=True
                )
            ],
            now_ns=now_ns,
        )

    def halt(self, *, now_ns: int) -> None:
        """Publishes a trajectory that ends where the joints were last read; nothing before the first reading."""
        if self._states.reading is not None:
            here = self._states.reading.position_rad
            self._publish([self._point(_HALT_NS, here, np.zeros_like(here))], now_ns=now_ns)

    def _point(self, time_ns: int, position: Array, velocity: Array) -> Any:
        seconds, nanoseconds = divmod(time_ns, 1_000_000_000)
        return wire.message(
            "trajectory_msgs/msg/JointTrajectoryPoint",
            positions=position,
            velocities=velocity,
            accelerations=np.zeros(0),
            effort=np.zeros(0),
            time_from_start=wire.message("builtin_interfaces/msg/Duration", sec=seconds, nanosec=nanoseconds),
        )

    def _publish(self, points: list[Any], *, now_ns: int) -> None:
        at_once = wire.message("builtin_interfaces/msg/Time", sec=0, nanosec=0)
        trajectory = wire.message(
            wire.JOINT_TRAJECTORY,
            header=wire.message("std_msgs/msg/Header", stamp=at_once, frame_id=""),
            joint_names=list(self._model.joint_names),
            points=points,
        )
        self._sequence += 1
        self._session.put(
            self._key,
            wire.encode(trajectory, wire.JOINT_TRAJECTORY),
            attachment=wire.attachment(self._sequence, stamp_ns=now_ns, writer=self._writer),
        )

    def tick(self, now_ns: int) -> None:
        """Takes in the joint states that have arrived; bytes that are none are counted, logged and left out."""
        self._states.tick(now_ns)
        with contextlib.suppress(IndexError):
            while True:
                self._take(*self._heard.popleft())

    def _take(self, noted_ns: int, payload: bytes) -> None:
        try:
            state = wire.decode(payload, wire.JOINT_STATE)
        except UserError as wrong:
            self._bus.leave_out(self._options.joint_states, wrong)
            return
        self._states.take(
            state.name,
            state.position,
            velocity_rad_s=state.velocity,
            effort_nm=state.effort,
            robot_ns=int(state.header.stamp.sec) * 1_000_000_000 + int(state.header.stamp.nanosec),
            noted_ns=noted_ns,
        )

    def read(self) -> JointReading | None:
        """Returns the latest joint state in the model's order; None before the first."""
        return self._states.reading

    def fault(self) -> str:
        """Returns why no joint state so far was the arm's, in one sentence; nothing once one was."""
        return self._states.fault()

    def close(self) -> None:
        """Closes the Zenoh session; the agent has brought what moves to rest before."""
        self._session.close()


def connect(link: DriverLink) -> Ros2Arm:
    """Connects to the robot's Zenoh router."""
    return Ros2Arm(link)
