"""A robot's side of ROS 1, for tests: joint states at 100 Hz and a FollowJointTrajectory action server.

Run as a process of its own: `python -m tests.system.ros1_arm MODEL [MODE]`. It follows goals exactly, linearly between
the points. Modes: `obey`, `reject`, `abort` (half way), `deaf` (serves, but never answers a goal), `foreign` (reports
other joint names), `gripper` (obeys, and a gripper's two joints are reported on the same topic).
"""

from __future__ import annotations

import sys
import threading
import time
from typing import Any

import numpy as np

sys.path.append("/usr/lib/python3/dist-packages")

import actionlib  # pyright: ignore[reportMissingImports]
import rospy  # pyright: ignore[reportMissingImports]
from sensor_msgs.msg import JointState  # pyright: ignore[reportMissingImports]

from station.arm.drivers._ros1_messages import follow_joint_trajectory
from station.rig.arm_model import ArmModel, load_arm_model


class RosArm:
    """Follows the latest goal; one that is cancelled or replaced is left where it is."""

    def __init__(self, model: ArmModel, *, mode: str) -> None:
        self.names = [f"foreign_{i}" for i in range(6)] if mode == "foreign" else [*model.joint_names, "finger_1"]
        self.position = np.array([*model.home_rad, 0.0])[: len(self.names)]
        self.mode = mode
        self.lock = threading.Lock()
        self.goal: Any = None
        self.began = 0.0
        self.messages = follow_joint_trajectory()
        self.publisher: Any = rospy.Publisher(f"/{model.name}_driver/out/joint_state", JointState, queue_size=2)
        name = f"/{model.name}/follow_joint_trajectory"
        self.server: Any = actionlib.ActionServer(
            name, self.messages.action, self.on_goal, self.on_cancel, auto_start=False
        )
        self.server.start()

    def on_goal(self, handle: Any) -> None:
        with self.lock:
            if self.mode == "deaf":
                return
            if self.mode == "reject":
                handle.set_rejected(self.messages.result(error_code=-1), "the arm is in its cradle")
                return
            if self.goal is not None:
                self.goal.set_canceled()
            handle.set_accepted()
            self.goal, self.began = handle, time.monotonic()

    def on_cancel(self, handle: Any) -> None:
        with self.lock:
            if handle == self.goal:
                self.goal = None
                handle.set_canceled()

    def step(self) -> None:
        with self.lock:
            if self.goal is not None:
                self.follow(self.goal.get_goal().trajectory.points)
        state: Any = JointState(name=self.names, position=self.position.tolist())
        state.header.stamp = rospy.Time.now()
        state.velocity = state.effort = [0.0] * len(self.names)
        self.publisher.publish(state)
        if self.mode == "gripper":
            self.publisher.publish(JointState(name=["finger_2", "finger_3"], position=[0.02, 0.02]))

    def follow(self, points: Any) -> None:
        times = np.array([point.time_from_start.to_sec() for point in points])
        elapsed = min(time.monotonic() - self.began, times[-1])
        for joint in range(6):
            self.position[joint] = np.interp(elapsed, times, [point.positions[joint] for point in points])
        if self.mode == "abort" and elapsed > times[-1] / 2:
            self.goal.set_aborted(self.messages.result(error_code=-4))
            self.goal = None
        elif elapsed >= times[-1]:
            self.goal.set_succeeded(self.messages.result(error_code=0))
            self.goal = None


def main() -> None:
    rospy.init_node("test_arm", anonymous=True)
    arm = RosArm(load_arm_model(sys.argv[1]), mode=sys.argv[2] if len(sys.argv) > 2 else "obey")
    while not rospy.is_shutdown():
        arm.step()
        time.sleep(0.01)


if __name__ == "__main__":
    main()
