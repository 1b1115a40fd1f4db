"""The messages of control_msgs/FollowJointTrajectory for ROS 1, made at run time.

Debian packages ROS 1 but not control_msgs, so its classes are generated here from the definitions; the md5 sums, by
which ROS nodes recognise each other, are the published ones (a test compares them).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

PUBLISHED_MD5 = {
    "control_msgs/FollowJointTrajectoryAction": "bc4f9b743838566551c0390c65f1a248",
}

_TOLERANCE = "string name\nfloat64 position\nfloat64 velocity\nfloat64 acceleration\n"
_GOAL = (
    "trajectory_msgs/JointTrajectory trajectory\nJointTolerance[] path_tolerance\n"
    "JointTolerance[] goal_tolerance\nduration goal_time_tolerance\n"
)
_RESULT = (
    "int32 error_code\nstring error_string\nint32 SUCCESSFUL = 0\nint32 INVALID_GOAL = -1\nint32 INVALID_JOINTS = -2\n"
    "int32 OLD_HEADER_TIMESTAMP = -3\nint32 PATH_TOLERANCE_VIOLATED = -4\nint32 GOAL_TOLERANCE_VIOLATED = -5\n"
)
_POINT = "trajectory_msgs/JointTrajectoryPoint"
_FEEDBACK = f"Header header\nstring[] joint_names\n{_POINT} desired\n{_POINT} actual\n{_POINT} error\n"
_NAME = "FollowJointTrajectory"


@dataclass(frozen=True)
class FollowJointTrajectory:
    """The generated classes: the action (as actionlib wants it), its goal, and its result."""

    action: Any
    goal: Any
    result: Any


def _sections() -> dict[str, str]:
    """Returns the definitions of every type by its name, without comments."""
    # These definitions come from ROS itself, whose business they are.
    from actionlib_msgs.msg import GoalID, GoalStatus  # noqa: PLC0415  # pyright: ignore[reportMissingImports]
    from std_msgs.msg import Header  # noqa: PLC0415  # pyright: ignore[reportMissingImports]
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint  # noqa: PLC0415  # pyright: ignore[reportMissingImports]

    known: dict[str, Any] = {
        "std_msgs/Header": Header,
        "actionlib_msgs/GoalID": GoalID,
        "actionlib_msgs/GoalStatus": GoalStatus,
        "trajectory_msgs/JointTrajectory": JointTrajectory,
        "trajectory_msgs/JointTrajectoryPoint": JointTrajectoryPoint,
    }
    sections = {name: str(cls._full_text).split("\n" + "=" * 80)[0] for name, cls in known.items()}
    own = {
        "JointTolerance": _TOLERANCE,
        f"{_NAME}Goal": _GOAL,
        f"{_NAME}Result": _RESULT,
        f"{_NAME}Feedback": _FEEDBACK,
        f"{_NAME}ActionGoal": f"Header header\nactionlib_msgs/GoalID goal_id\n{_NAME}Goal goal\n",
        f"{_NAME}ActionResult": f"Header header\nactionlib_msgs/GoalStatus status\n{_NAME}Result result\n",
        f"{_NAME}ActionFeedback": f"Header header\nactionlib_msgs/GoalStatus status\n{_NAME}Feedback feedback\n",
    }
    return sections | {f"control_msgs/{name}": text for name, text in own.items()}


def follow_joint_trajectory() -> FollowJointTrajectory:
    """Generates the classes; ImportError when ROS 1 is not installed."""
    # ROS is there only where an arm speaks it.
    from genpy.dynamic import generate_dynamic  # noqa: PLC0415  # pyright: ignore[reportMissingImports]

    text = "".join(f"{_NAME}Action{part} action_{part.lower()}\n" for part in ("Goal", "Result", "Feedback"))
    for name, definition in _sections().items():
        text += f"{'=' * 80}\nMSG: {name}\n{definition}\n"
    classes: dict[str, Any] = generate_dynamic(f"control_msgs/{_NAME}Action", text)
    return FollowJointTrajectory(
        action=classes[f"control_msgs/{_NAME}Action"],
        goal=classes[f"control_msgs/{_NAME}Goal"],
        result=classes[f"control_msgs/{_NAME}Result"],
    )
