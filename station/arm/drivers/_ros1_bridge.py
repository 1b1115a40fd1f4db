"""The ROS 1 side of the `ros1` driver, a process of its own.

It runs under the Python that ROS was made for (3.8 or newer), needs nothing of this program but the file beside it,
and keeps ROS's threads, logging and signals away from the arm agent. JSON lines: orders come in on stdin, what happens
goes out on stdout. When stdin ends, because the agent ended or was killed, every goal is cancelled.

In: {"goal": id, "names": [], "times_ns": [], "positions": [[]], "velocities": [[]]} or {"cancel": true}.
Out: {"ready": true} | {"error": text} | {"state": [stamp_ns, names, positions, velocities, efforts]} |
{"goal": id, "status": name, "done": whether its result has come, "code": number, "text": text}.
"""

from __future__ import annotations

import functools
import json
import os
import sys
import threading
from typing import Any, TextIO

_STATUSES = ("PENDING", "ACTIVE", "PREEMPTED", "SUCCEEDED", "ABORTED", "REJECTED", "RECALLED", "LOST")


class Bridge:
    """Joins one robot's topics to the two pipes; `options` has `action`, `joint_states` and `connect_timeout_s`."""

    def __init__(self, options: dict[str, Any], out: TextIO) -> None:
        self.options = options
        self.out = out
        self.lock = threading.Lock()
        self.goals: dict[int, Any] = {}
        self.client: Any = None

    def say(self, **line: Any) -> None:
        """Writes one line; many threads may."""
        with self.lock:
            self.out.write(json.dumps(line) + "\n")
            self.out.flush()

    def connect(self) -> bool:
        """Finds the robot; says `ready` or `error`."""
        import actionlib  # noqa: PLC0415  # pyright: ignore[reportMissingImports]
        import rospy  # noqa: PLC0415  # pyright: ignore[reportMissingImports]
        from _ros1_messages import follow_joint_trajectory  # noqa: PLC0415  # pyright: ignore
        from sensor_msgs.msg import JointState  # noqa: PLC0415  # pyright: ignore[reportMissingImports]

        self.messages: Any = follow_joint_trajectory()
        self.rospy: Any = rospy
        rospy.init_node("repose_arm", anonymous=True, disable_signals=True)
        rospy.Subscriber(self.options["joint_states"], JointState, self.on_state, queue_size=100)
        self.client = actionlib.ActionClient(self.options["action"], self.messages.action)
        if not self.client.wait_for_server(rospy.Duration(self.options["connect_timeout_s"])):
            self.say(error="nobody serves " + str(self.options["action"]))
            return False
        self.say(ready=True)
        return True

    def on_state(self, state: Any) -> None:
        """Takes a joint state that came from the robot."""
        stamp_ns = state.header.stamp.to_nsec()
        self.say(state=[stamp_ns, list(state.name), list(state.position), list(state.velocity), list(state.effort)])

    def obey(self, order: dict[str, Any]) -> None:
        """Carries out one order of the agent."""
        if "goal" in order:
            number = int(order["goal"])
            self.goals = {number: self.client.send_goal(self.goal(order), functools.partial(self.on_goal, number))}
        elif "cancel" in order:
            self.client.cancel_all_goals()

    def goal(self, order: dict[str, Any]) -> Any:
        """Returns the ROS message of a motion."""
        from trajectory_msgs.msg import JointTrajectoryPoint  # noqa: PLC0415  # pyright: ignore[reportMissingImports]

        goal = self.messages.goal()
        goal.trajectory.joint_names = order["names"]
        for time_ns, position, velocity in zip(order["times_ns"], order["positions"], order["velocities"]):  # noqa: B905
            after = self.rospy.Duration(*divmod(time_ns, 1_000_000_000))
            goal.trajectory.points.append(
                JointTrajectoryPoint(positions=position, velocities=velocity, time_from_start=after)
            )
        return goal

    def on_goal(self, number: int, handle: Any) -> None:
        """Takes what the robot said about a goal."""
        from actionlib import CommState  # noqa: PLC0415  # pyright: ignore[reportMissingImports]
        from actionlib_msgs.msg import GoalStatus  # noqa: PLC0415  # pyright: ignore[reportMissingImports]

        names = {getattr(GoalStatus, name): name for name in _STATUSES}
        result = handle.get_result()
        self.say(
            goal=number,
            status=names.get(handle.get_goal_status(), ""),
            done=handle.get_comm_state() in {CommState.DONE, CommState.LOST},
            code=int(getattr(result, "error_code", 0) or 0),
            text=str(getattr(result, "error_string", "") or handle.get_goal_status_text() or ""),
        )

    def serve(self, orders: TextIO) -> None:
        """Obeys until the orders end; then leaves nothing moving."""
        for line in orders:
            self.obey(json.loads(line))
        self.client.cancel_all_goals()
        self.rospy.sleep(0.2)  # the cancellation goes out on a thread of ROS


def main() -> None:
    """Runs until stdin ends; the one argument is the options as JSON."""
    options: dict[str, Any] = json.loads(sys.argv[1])
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # ROS's own prints must not get between the lines
    sys.path.append(options["ros_path"])
    bridge = Bridge(options, out)
    try:
        connected = bridge.connect()
    except ImportError as missing:
        bridge.say(error=f"ROS 1 is not installed for this Python ({missing})")
        connected = False
    if connected:
        bridge.serve(sys.stdin)
    os._exit(0)  # ROS's threads would keep the process alive


if __name__ == "__main__":
    main()
