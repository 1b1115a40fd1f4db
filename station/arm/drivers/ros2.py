"""Arms under ROS 2 with a joint_trajectory_controller, over Zenoh as rmw_zenoh speaks it; no ROS needed here.

A motion is a stream of short trajectories (trajectory_msgs/JointTrajectory), each of which ends at rest and is replaced
before (`_horizons`), and a halt is one that brakes now. They are stamped by the robot's clock, so that one follows
another without a jump, however long it is on its way; a robot without stamps begins each on its arrival. Checked:
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
from station.arm.drivers._horizons import Horizons
from station.arm.drivers._joint_states import JointStates
from station.arm.drivers._robot_clock import Arrivals
from station.arm.trajectory import JointTrajectory

Array = NDArray[np.float64]
_NODE = "repose_arm"
_HOLD_NS = 1_000_000_000
"""The time after which a trajectory's last point is told again: a controller refuses one that has ended on its arrival,
and a halt of a slow motion is over in 20 ms."""
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
        limit = link.model.max_acceleration_rad_s2 * link.acceleration_share
        self._horizons = Horizons(limit)
        self._ahead_ns: int | None = None
        """This machine's time minus the robot's for the motion under way; None while the robot stamps nothing."""
        self._fault = ""
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
        """Publishes the motion's first horizon; the controller replaces what it was doing."""
        if self._horizons.late_s(now_ns):
            return  # the arm has left the plan from which this one goes on: the next tick says so
        self._fault = ""
        robot_ns = self._states.robot_ns(now_ns)
        self._ahead_ns = None if robot_ns is None else now_ns - robot_ns
        self._publish(self._horizons.begin(trajectory, now_ns=now_ns), now_ns=now_ns)

    def halt(self, *, now_ns: int) -> None:
        """Publishes the way to rest from where the arm was told to be now; nothing when it was told to rest."""
        if (rest := self._horizons.halted(now_ns)) is not None:
            self._publish(rest, now_ns=now_ns)

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

    def _publish(self, horizon: JointTrajectory, *, now_ns: int) -> None:
        times_ns: list[int] = horizon.times_ns.tolist()
        states = list(zip(times_ns, horizon.position_rad, horizon.velocity_rad_s, strict=True))
        states.append((times_ns[-1] + _HOLD_NS, *horizon.at(times_ns[-1])))
        trajectory = wire.message(
            wire.JOINT_TRAJECTORY,
            header=wire.message("std_msgs/msg/Header", stamp=self._stamp(now_ns), frame_id=""),
            joint_names=list(self._model.joint_names),
            points=[self._point(*state) for state in states],
        )
        self._sequence += 1
        self._session.put(
            self._key,
            wire.encode(trajectory, wire.JOINT_TRAJECTORY),
            attachment=wire.attachment(self._sequence, stamp_ns=now_ns, writer=self._writer),
        )

    def _stamp(self, now_ns: int) -> Any:
        """Returns this moment by the robot's clock, or zeros, which mean the arrival."""
        robot_ns = 0 if self._ahead_ns is None else now_ns - self._ahead_ns
        seconds, nanoseconds = divmod(robot_ns, 1_000_000_000)
        return wire.message("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)

    def tick(self, now_ns: int) -> None:
        """Publishes the next horizon once it is due, and takes in the joint states that have arrived.

        Bytes that are none are counted, logged and left out.
        """
        if late_s := self._horizons.late_s(now_ns):
            self._fault = f"this machine was busy for {late_s:.1f} s, and the arm braked by itself: give it less to do"
        elif horizon := self._horizons.renewed(now_ns):
            self._publish(horizon, now_ns=now_ns)
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
        """Returns why no joint state is the arm's, or why it left its motion, in a sentence; empty if all is well."""
        return self._fault or self._states.fault()

    def close(self) -> None:
        """Closes the Zenoh session; what moves comes to rest with its last horizon."""
        self._session.close()


def connect(link: DriverLink) -> Ros2Arm:
    """Connects to the robot's Zenoh router."""
    return Ros2Arm(link)
