"""A ROS 2 robot for tests: it is what joint_trajectory_controller and joint_state_broadcaster are on rmw_zenoh.

It follows the last trajectory that came, linearly between its points, and reports its joints at every step. A stamp in
the trajectory is its begin by the robot's clock; one that has ended by then is refused, as the real controller does.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from shared.zenoh_bus import RawSession
from station.arm.drivers import _ros2_wire as wire
from station.rig.arm_model import ArmModel

TRAJECTORY = "/joint_trajectory_controller/joint_trajectory"


class Ros2Robot:
    """The robot's end; `step` lets it move and report."""

    def __init__(self, model: ArmModel, *, endpoint: str, domain: int = 7) -> None:
        self.names = ["finger_1", *model.joint_names[::-1]]  # a robot's own order, not the model's
        self.position = np.array(model.home_rad)
        self.domain = domain
        self.ahead_ns = 0  # its clock minus ours
        self.session = RawSession(connect=[endpoint])
        self.received: list[tuple[bytes, bytes]] = []
        self.motion: tuple[int, Any, Any] | None = None
        self.session.subscribe(
            wire.data_key(TRAJECTORY, wire.JOINT_TRAJECTORY, domain=domain),
            self.receive,
        )
        self.session.announce(
            wire.subscriber_token(
                self.session.id,
                domain=domain,
                node="joint_trajectory_controller",
                entity=1,
                topic=TRAJECTORY,
                type_name=wire.JOINT_TRAJECTORY,
            )
        )
        self.key = wire.data_key("/joint_states", wire.JOINT_STATE, domain=domain)
        self.taken = 0

    def receive(self, payload: bytes, attachment: bytes) -> None:
        self.received.append((payload, attachment))

    def step(self, now_ns: int) -> None:
        if len(self.received) > self.taken:
            self.take(self.received[-1][0], now_ns)
            self.taken = len(self.received)
        if self.motion is not None:
            began_ns, times, positions = self.motion
            elapsed = (now_ns - began_ns) * 1e-9
            self.position = np.array([np.interp(elapsed, times, positions[:, joint]) for joint in range(6)])
        self.report(now_ns)

    def take(self, payload: bytes, now_ns: int) -> None:
        message = wire.decode(payload, wire.JOINT_TRAJECTORY)
        stamp_ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        began_ns = stamp_ns - self.ahead_ns if stamp_ns else now_ns
        times = [point.time_from_start.sec + point.time_from_start.nanosec * 1e-9 for point in message.points]
        positions = np.array([point.positions for point in message.points])
        if began_ns + times[-1] * 1e9 < now_ns:
            return
        if began_ns + times[0] * 1e9 > now_ns:
            times, positions = [(now_ns - began_ns) * 1e-9, *times], np.vstack([self.position, positions])
        self.motion = (began_ns, np.array(times), positions)

    def report(self, now_ns: int) -> None:
        self.say(self.names, [0.0, *self.position[::-1]], now_ns=now_ns)

    def say(self, names: list[str], position: Any, *, now_ns: int) -> None:
        """Publish a joint state; a gripper's broadcaster uses the same topic."""
        seconds, nanoseconds = divmod(now_ns + self.ahead_ns, 10**9)
        stamp = wire.message("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)
        state = wire.message(
            wire.JOINT_STATE,
            header=wire.message("std_msgs/msg/Header", stamp=stamp, frame_id=""),
            name=names,
            position=np.array(position, dtype=np.float64),
            velocity=np.zeros(len(names)),
            effort=np.zeros(0),
        )
        self.session.put(self.key, wire.encode(state, wire.JOINT_STATE))

    def close(self) -> None:
        self.session.close()
